"""Waiting for movement without delay: the simulated clock advances by itself."""

from a7sim.instrument.language import Engine
from a7sim.link.clock import Clock


def feed_until_idle(engine: Engine, received: bytes, clock: Clock) -> bytes:
    """Feed an engine and advance the clock to the end of each wait; return the bytes of all replies."""
    replies = engine.feed(received, clock.now)
    while engine.waits_until is not None:
        clock.advance_to(engine.waits_until)
        replies += engine.feed(b"", clock.now)
    return replies
