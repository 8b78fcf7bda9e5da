"""An instrument served to the tests, in a thread of this process, on every kind of wire at once."""

import asyncio
import tempfile
import threading
from contextlib import contextmanager
from pathlib import Path
from queue import Queue

from a7sim.instrument import build_autograph
from a7sim.instrument.language import Desk
from a7sim.link.addresses import Address
from a7sim.link.clock import Clock
from a7sim.link.conversation import Terms
from a7sim.link.serving import Doors, Server
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene


def new_desk(scenario="akwanga", seed=7):
    loaded = load_scenario(scenario) if isinstance(scenario, str) else scenario
    return Desk(build_autograph(loaded.instrument, build_scene(loaded, seed).drawer, seed))


@contextmanager
def everywhere(desk):
    """Serve a desk; yield its URLs by kind."""
    opened = Queue()
    with tempfile.TemporaryDirectory() as folder:
        any_port = Address("127.0.0.1", 0)

        async def serve():
            server = Server(desk, Clock(), Terms())
            stop = asyncio.Event()
            doors = await server.open(Doors([any_port], [any_port], [Path(folder) / "pty"]))
            opened.put(({door["kind"]: door["url"] for door in doors}, asyncio.get_running_loop(), stop))
            try:
                await stop.wait()
            finally:
                await server.close()

        thread = threading.Thread(target=asyncio.run, args=(serve(),), daemon=True)
        thread.start()
        urls, loop, stop = opened.get(timeout=10.0)
        try:
            yield urls | {"socket": urls["tcp"], "tcp": urls["tcp"].replace("socket://", "tcp://")}
        finally:
            loop.call_soon_threadsafe(stop.set)
            thread.join(10.0)


@contextmanager
def served(kind, desk):
    """Serve a desk; yield its URL of one kind."""
    with everywhere(desk) as urls:
        yield urls[kind]
