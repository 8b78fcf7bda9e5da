"""Client sessions of an instrument without a link: lines in, reply lines out."""

from functools import cache

from a7sim.instrument import Autograph, build_autograph
from a7sim.instrument.language import Listener, SharedInstrument
from a7sim.link.clock import Clock
from a7sim.link.simulated_wait import feed_until_idle
from a7sim.plotters import VARIANTS
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene
from a7sim.scene.photograph import Photograph

SEED = 7

MODEL_1 = (
    'PHOT1:LOAD "101";:PHOT2:LOAD "102"',
    "PROJ1:PDIS 152.68;:PROJ2:PDIS 152.68;:BASE:BX 194.99;:DRIV:Z -325.71",
)
"""Lines that mount Akwanga's first model; point 1011 then lies in the field of view of both eyepieces."""


class EngineClient:
    """A client session whose lines go directly to the engine, with a simulated clock."""

    def __init__(self, instrument: SharedInstrument | None = None, cr_ends_line: bool = True) -> None:
        self.instrument = instrument or SharedInstrument(Autograph(VARIANTS["A7"]))
        self.engine = self.instrument.open(cr_ends_line=cr_ends_line)
        self.clock = Clock()

    def feed(self, received: bytes) -> bytes:
        """Send bytes, wait until the instrument is idle, and return its reply."""
        return feed_until_idle(self.engine, received, self.clock)

    def query(self, line: str) -> str:
        """Send a line and return its reply without LF, '' if there is none; at most one reply line is allowed."""
        reply = self.feed(line.encode("latin-1") + b"\n").decode("ascii")
        assert reply.count("\n") == (reply != ""), f"{line} was answered {reply!r}"
        return reply.removesuffix("\n")

    def numbers(self, line: str) -> list[float]:
        """Send a line and return the numbers of its reply."""
        return [float(number) for number in self.query(line).replace(";", ",").split(",")]

    def errors(self) -> list[int]:
        """Empty the error queue and return its numbers, oldest first."""
        return [int(self.query("SYST:ERR?").split(",")[0]) for _ in range(int(self.query("SYST:ERR:COUN?")))]


@cache
def _photographs() -> dict[str, Photograph]:
    return dict(build_scene(load_scenario("akwanga"), SEED).photographs)


def with_photographs(listener: Listener | None = None) -> EngineClient:
    """Return a client of Akwanga's instrument; its photographs can be loaded."""
    autograph = build_autograph(load_scenario("akwanga").instrument, _photographs(), SEED)
    return EngineClient(SharedInstrument(autograph, listener))


def with_model(listener: Listener | None = None) -> EngineClient:
    """Return a client of Akwanga's instrument with its first model mounted."""
    client = with_photographs(listener)
    for line in MODEL_1:
        assert client.query(line) == ""
    return client
