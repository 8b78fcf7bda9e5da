"""Servers that return their input, the floor of benchmarks/links.py: `python echoes.py threads|asyncio|pty`.

Each prints its port or device.
"""

import asyncio
import os
import socket
import sys
import threading
import tty

MAX_READ = 16 * 1024


def threads():
    """A thread for each client, which waits for bytes and sends them."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        print(listener.getsockname()[1], flush=True)
        while True:
            connection, _ = listener.accept()
            threading.Thread(target=_echoed, args=(connection,), daemon=True).start()


def _echoed(connection):
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    while heard := connection.recv(MAX_READ):
        connection.sendall(heard)


class Echo(asyncio.BufferedProtocol):
    """A protocol that writes what it receives, quicker than asyncio.Protocol, which allocates 256 KiB for each read."""

    def __init__(self):
        self._buffer = bytearray(MAX_READ)

    def connection_made(self, transport):
        """Remember where to write."""
        self._transport = transport

    def get_buffer(self, sizehint):
        """Return where to read into."""
        return self._buffer

    def buffer_updated(self, nbytes):
        """Write what was read."""
        self._transport.write(bytes(memoryview(self._buffer)[:nbytes]))


async def protocol():
    """One loop and a protocol for each client."""
    server = await asyncio.get_running_loop().create_server(Echo, "127.0.0.1", 0)
    print(server.sockets[0].getsockname()[1], flush=True)
    await server.serve_forever()


def pty():
    """A pseudo-terminal in raw mode, read and written without a loop of events."""
    near, far = os.openpty()
    tty.setraw(far)
    print(os.ttyname(far), flush=True)
    while True:
        os.write(near, os.read(near, MAX_READ))


if __name__ == "__main__":
    kind = sys.argv[1]
    if kind == "asyncio":
        asyncio.run(protocol())
    else:
        {"threads": threads, "pty": pty}[kind]()
