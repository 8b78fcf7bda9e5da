"""Servers in separate processes, for the benchmarks of the link."""

import json
import socket
import subprocess
import sys
import time
from contextlib import contextmanager

SECONDS_TO_START = 20.0


@contextmanager
def running(command, **how):
    """Run a command, with its standard output as a pipe of text, until the context ends."""
    process = subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, text=True, **how)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@contextmanager
def a7sim(*options):
    """Serve the Akwanga instrument; yield the process and its endpoints by kind."""
    serve = [sys.executable, "-m", "a7sim", "serve", "akwanga", "--json", *options]
    with running(serve) as process:
        document = ""
        for line in process.stdout:
            document += line
            if line == "}\n":
                break
        yield process, {endpoint["kind"]: endpoint for endpoint in json.loads(document)["listening"]}


def standing_at(port, reading=-123.45):
    """Drive to a reading whose answer of the X counter has eight bytes, the number of bytes of the other servers."""
    with socket.create_connection(("127.0.0.1", port)) as connection:
        connection.sendall(f"DRIV:X {reading};*OPC?\n".encode())
        connection.recv(16)


def free_port():
    """Return a free port."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def once(attempt):
    """Return the result of an attempt as soon as it raises no OSError."""
    deadline = time.monotonic() + SECONDS_TO_START
    while True:
        try:
            return attempt()
        except OSError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)
