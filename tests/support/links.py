"""An instrument served on every kind of link at once."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from a7sim.instrument import build_autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.link.server.serving import Endpoints
from a7sim.scenario import Scenario, load_scenario
from a7sim.scene import build_scene
from tests.support.server_thread import ANY_PORT, ServerThread


def new_instrument(scenario: str | Scenario = "akwanga", seed: int = 7) -> SharedInstrument:
    """Return the instrument of a scenario; its photographs can be loaded."""
    loaded = load_scenario(scenario) if isinstance(scenario, str) else scenario
    return SharedInstrument(build_autograph(loaded.instrument, build_scene(loaded, seed).mountable, seed))


@contextmanager
def serve_on_all_links(instrument: SharedInstrument) -> Iterator[dict[str, str]]:
    """Serve an instrument; yield its URLs by kind of link."""
    with tempfile.TemporaryDirectory() as folder:
        endpoints = Endpoints([ANY_PORT], [ANY_PORT], [Path(folder) / "pty"])
        with ServerThread(instrument, endpoints=endpoints) as server:
            urls = {str(endpoint["kind"]): str(endpoint["url"]) for endpoint in server.listening}
            yield urls | {"socket": urls["tcp"].replace("tcp://", "socket://")}


@contextmanager
def serve_on(kind: str, instrument: SharedInstrument) -> Iterator[str]:
    """Serve an instrument; yield its URL of one kind of link."""
    with serve_on_all_links(instrument) as urls:
        yield urls[kind]
