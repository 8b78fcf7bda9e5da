"""When a server gives up the processor to a client that is about to ask."""

import os
from time import monotonic

BRIEFLY, UNTIL_ALONE = 0.5e-3, 1.0
"""s; who twice in a row gets the processor back later than this has company, and keeps it for a while."""


class YieldPolicy:
    """Giving up the processor between two looks, which is quicker than to sleep and be woken.

    Where others want the processor it would be theirs for milliseconds, so there it is kept.
    """

    def __init__(self) -> None:
        self._alone_from = 0.0
        self._was_brief = True

    def yield_cpu(self) -> bool:
        """Give up the processor, unless others want it; return whether that was done."""
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
