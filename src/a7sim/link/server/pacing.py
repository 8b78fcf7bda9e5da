"""A line as slow as the real wire: ten bits a byte, each byte after the one before it."""

import asyncio
from collections import deque
from collections.abc import Callable

BITS_A_BYTE = 10
"""A start bit, eight data bits, a stop bit."""

SLICE = 0.01
"""s of the line that are handed on at once."""


class BaudLimiter:
    """Hands bytes on, in order, when a line of a baud rate (None: at once) that is late by a delay in s would."""

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        deliver: Callable[[bytes], None],
        baud: int | None = None,
        delay: float = 0.0,
    ) -> None:
        self.size = 0
        """Bytes on the line."""
        self._loop = loop
        self._deliver = deliver
        self._seconds_a_byte = BITS_A_BYTE / baud if baud else 0.0
        self._slice = max(1, round(SLICE / self._seconds_a_byte)) if baud else None
        self._delay = delay
        self._free_at = 0.0
        self._due: deque[tuple[float, bytes]] = deque()
        self._timer: asyncio.TimerHandle | None = None

    def put(self, data: bytes) -> None:
        """Send bytes on their way."""
        earliest = self._loop.time() + self._delay
        step = self._slice or max(1, len(data))
        for start in range(0, len(data), step):
            part = data[start : start + step]
            self._free_at = max(self._free_at, earliest) + self._seconds_a_byte * len(part)
            self._due.append((self._free_at, part))
        self.size += len(data)
        self._set_timer()

    def clear(self) -> None:
        """Forget what is on its way."""
        self._due.clear()
        self.size = 0
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _set_timer(self) -> None:
        if self._timer is None and self._due:
            self._timer = self._loop.call_at(self._due[0][0], self._arrived)

    def _arrived(self) -> None:
        self._timer = None
        while self._due and self._due[0][0] <= self._loop.time():
            _, data = self._due.popleft()
            self.size -= len(data)
            self._deliver(data)
        self._set_timer()
