"""Policy of yielding the processor to a client that is about to send."""

import os
from time import monotonic

BRIEFLY, UNTIL_ALONE = 0.5e-3, 1.0
"""s; a server that twice in a row gets the processor back later than this has competitors, and keeps it for a while."""


class YieldPolicy:
    """Yielding of the processor between two polls, which is faster than sleeping and waking.

    If other processes want the processor they would keep it for milliseconds, so the server does not yield.
    """

    def __init__(self) -> None:
        self._alone_from = 0.0
        self._was_brief = True

    def yield_cpu(self) -> bool:
        """Yield the processor, unless others want it; return whether it was yielded."""
        left_at = monotonic()
        if left_at < self._alone_from:
            return False
        os.sched_yield()
        back_at = monotonic()
        brief = back_at - left_at < BRIEFLY
        if not brief and not self._was_brief:
            self._alone_from = back_at + UNTIL_ALONE
        self._was_brief = brief
        return True
