"""`serial.serial_for_url("a7sim://scenarios/akwanga.toml?seed=7")`: an instrument of one's own, in process.

pyserial finds this module by its name; importing a7sim adds its package to
`serial.protocol_handler_packages`. The path is that of a scenario file, or the bare name of one that comes
with a7sim; `seed` draws its photographs.
"""

from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from serial import SerialException

from a7sim.instrument import build_autograph
from a7sim.instrument.language import Desk
from a7sim.link.inprocess import InProcessSerial
from a7sim.mistakes import Mistake
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene

_EXAMPLE = "a7sim://scenarios/akwanga.toml?seed=7"


class Serial(InProcessSerial):
    """A pyserial port to a new instrument that the URL describes. Raises SerialException for a bad URL."""

    def __init__(self, port: str | None = None, *args: Any, **kwargs: Any) -> None:
        super().__init__(None, *args, **kwargs)
        self.port = port
        if port is not None:
            self.open()

    def _connect(self) -> Desk:
        scenario_name, seed = _taken_apart(str(self.port))
        try:
            scenario = load_scenario(scenario_name)
            chosen = scenario.seed if seed is None else seed
            photographs = build_scene(scenario, chosen).photographs
        except Mistake as mistake:
            raise SerialException(str(mistake)) from mistake
        return Desk(build_autograph(scenario.instrument, photographs, chosen))


def _taken_apart(url: str) -> tuple[str, int | None]:
    parts = urlsplit(url)
    options = parse_qs(parts.query, keep_blank_values=True)
    unknown = sorted(set(options) - {"seed"})
    seed = options.get("seed", [""])[-1]
    if parts.scheme != "a7sim" or unknown or (seed and not seed.isdecimal()) or not parts.netloc + parts.path:
        raise SerialException(f"expected a URL like {_EXAMPLE}, got {url!r}")
    return unquote(parts.netloc + parts.path), int(seed) if seed else None
