"""Waiting for movement where nobody's time is lost: the simulated clock runs on by itself."""

from a7sim.instrument.language import Engine
from a7sim.link.clock import Clock


def feed_until_idle(engine: Engine, received: bytes, clock: Clock) -> bytes:
    """Feed an engine and let the clock run to where each wait ends; return the bytes of all replies."""
    replies = engine.feed(received, clock.now)
    while engine.waits_until is not None:
        clock.advance_to(engine.waits_until)
        replies += engine.feed(b"", clock.now)
    return replies
