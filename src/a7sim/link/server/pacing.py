"""Pacing of a serial line: ten bits per byte, in order."""

import asyncio
from collections import deque
from collections.abc import Callable

BITS_A_BYTE = 10
"""A start bit, eight data bits, a stop bit."""

SLICE = 0.01
"""Duration in s of the bytes that are passed on at once."""


class BaudLimiter:
    """Passes bytes on, in order, at the time of a line with a baud rate (None: at once) and a delay in s."""

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        deliver: Callable[[bytes], None],
        baud: int | None = None,
        delay: float = 0.0,
    ) -> None:
        self.size = 0
        """Bytes in transit."""
        self._loop = loop
        self._deliver = deliver
        self._seconds_a_byte = BITS_A_BYTE / baud if baud else 0.0
        self._slice = max(1, round(SLICE / self._seconds_a_byte)) if baud else None
        self._delay = delay
        self._free_at = 0.0
        self._due: deque[tuple[float, bytes]] = deque()
        self._timer: asyncio.TimerHandle | None = None

    def put(self, data: bytes) -> None:
        """Send bytes."""
        earliest = self._loop.time() + self._delay
        step = self._slice or max(1, len(data))
        for start in range(0, len(data), step):
            part = data[start : start + step]
            self._free_at = max(self._free_at, earliest) + self._seconds_a_byte * len(part)
            self._due.append((self._free_at, part))
        self.size += len(data)
        self._set_timer()

    def clear(self) -> None:
        """Discard the bytes in transit."""
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
