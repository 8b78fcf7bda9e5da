"""Wires to one instrument for the tests: TCP, pty and RFC 2217, each with an engine behind it."""

import os
import select
import socket
import threading
import tty
from contextlib import contextmanager, suppress

from serial import rfc2217

from a7sim.instrument import build_autograph
from a7sim.instrument.language import Desk
from a7sim.link.clock import Clock
from a7sim.link.inprocess import InProcessSerial
from a7sim.link.waiting import obeyed
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene


def new_desk(scenario="akwanga", seed=7):
    loaded = load_scenario(scenario) if isinstance(scenario, str) else scenario
    return Desk(build_autograph(loaded.instrument, build_scene(loaded, seed).drawer, seed))


def tcp_talk(desk, connection):
    engine, clock = desk.open(cr_ends_line=False), Clock()
    with connection, suppress(OSError):
        while received := connection.recv(65536):
            connection.sendall(obeyed(engine, received, clock))
    desk.close(engine.client)


def rfc2217_talk(desk, connection):
    with connection, suppress(OSError), InProcessSerial(desk=desk, timeout=0) as port:
        lock = threading.Lock()

        class Connection:
            def write(self, data):
                with lock:
                    connection.sendall(data)

        manager = rfc2217.PortManager(port, Connection())
        while received := connection.recv(65536):
            port.write(b"".join(manager.filter(received)))
            connection.sendall(b"".join(manager.escape(port.read(port.in_waiting))))


@contextmanager
def listening(talk, desk):
    """Serve every connection in a thread of its own; yield HOST:PORT."""
    connections = []
    with socket.create_server(("127.0.0.1", 0)) as server:

        def accept():
            with suppress(OSError):
                while True:
                    connection, _ = server.accept()
                    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    connections.append(connection)
                    threading.Thread(target=talk, args=(desk, connection), daemon=True).start()

        threading.Thread(target=accept, daemon=True).start()
        host, port = server.getsockname()
        try:
            yield f"{host}:{port}"
        finally:
            for connection in connections:
                with suppress(OSError):
                    connection.shutdown(socket.SHUT_RDWR)
            with suppress(OSError):
                server.shutdown(socket.SHUT_RDWR)


@contextmanager
def on_a_pty(desk):
    """Serve one client on a pty; yield its path."""
    master, slave = os.openpty()
    tty.setraw(slave)
    stopping, stop = os.pipe()

    def talk():
        engine, clock = desk.open(), Clock()
        with suppress(OSError):
            while master in select.select([master, stopping], [], [])[0]:
                os.write(master, obeyed(engine, os.read(master, 65536), clock))

    thread = threading.Thread(target=talk, daemon=True)
    thread.start()
    try:
        yield os.ttyname(slave)
    finally:
        os.write(stop, b".")
        thread.join()
        for descriptor in (master, slave, stopping, stop):
            os.close(descriptor)


@contextmanager
def served(kind, desk):
    """Serve a desk; yield the URL."""
    if kind == "pty":
        with on_a_pty(desk) as path:
            yield path
    else:
        with listening(rfc2217_talk if kind == "rfc2217" else tcp_talk, desk) as address:
            yield f"{kind}://{address}"
