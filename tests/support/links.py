"""One instrument served to the tests on every kind of wire at once."""

import tempfile
from contextlib import contextmanager
from pathlib import Path

from a7sim.instrument import build_autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.link.server.serving import Endpoints
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene
from tests.served import ANYWHERE, Served


def new_desk(scenario="akwanga", seed=7):
    loaded = load_scenario(scenario) if isinstance(scenario, str) else scenario
    return SharedInstrument(build_autograph(loaded.instrument, build_scene(loaded, seed).mountable, seed))


@contextmanager
def everywhere(instrument):
    """Serve a instrument; yield its URLs by kind."""
    with tempfile.TemporaryDirectory() as folder:
        doors = Endpoints([ANYWHERE], [ANYWHERE], [Path(folder) / "pty"])
        with Served(instrument, doors=doors) as opened:
            urls = {door["kind"]: door["url"] for door in opened.opened}
            yield urls | {"socket": urls["tcp"].replace("tcp://", "socket://")}


@contextmanager
def served(kind, instrument):
    """Serve a instrument; yield its URL of one kind."""
    with everywhere(instrument) as urls:
        yield urls[kind]
