"""`serial.serial_for_url("a7sim://scenarios/akwanga.toml?seed=7")`: a new instrument in process.

pyserial finds this module by its name; importing a7sim adds its package to `serial.protocol_handler_packages`. The path
is that of a scenario file, or the bare name of one that comes with a7sim; `seed` draws its photographs. A port that is
closed and opened again has the same instrument.
"""

import re
from urllib.parse import unquote

from serial import SerialException

from a7sim.errors import A7SimError
from a7sim.instrument import Autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.link.inprocess import InProcessSerial
from a7sim.scenario import load_scenario

_EXAMPLE = "a7sim://scenarios/akwanga.toml?seed=7"

_URL = re.compile(r"a7sim://([^?#]+)(?:\?seed=([0-9]{1,40}))?", re.IGNORECASE)


class Serial(InProcessSerial):
    """Pyserial port of a new instrument described by the URL. Raises SerialException for a bad URL."""

    _connected_to: str | None = None

    def _connect(self) -> SharedInstrument:
        url = str(self.port)
        if self._instrument is None or self._connected_to != url:
            self._instrument, self._connected_to = _build_instrument(url), url
        return self._instrument


def _build_instrument(url: str) -> SharedInstrument:
    scenario_name, seed = _parse_url(url)
    try:
        scenario = load_scenario(scenario_name)
        chosen = scenario.seed if seed is None else seed
        autograph = Autograph.from_scenario(scenario, chosen)
    except (A7SimError, OSError) as error:
        raise SerialException("; ".join(str(error).splitlines())) from error
    return SharedInstrument(autograph)


def _parse_url(url: str) -> tuple[str, int | None]:
    found = _URL.fullmatch(url)
    if found is None:
        raise SerialException(f"expected a URL like {_EXAMPLE}, got {url!r}")
    return unquote(found[1]), int(found[2]) if found[2] else None
