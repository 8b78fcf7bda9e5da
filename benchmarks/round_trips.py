"""Clients that time round trips of one query, the same code whoever answers.

As a program, a VISA client in a process of its own: `python round_trips.py RESOURCE LIBRARY` prints the first answer,
then for every number on standard input so many times in s as a JSON list. It needs nothing but pyvisa.
"""

import json
import socket
import sys
import time

QUERY = b"COUN:X?"
PATIENCE = 5.0
"""s."""


def timed(ask, count):
    """Return the times in s of so many round trips, one after the other."""
    took = []
    for _ in range(count):
        began = time.perf_counter()
        ask()
        took.append(time.perf_counter() - began)
    return took


def by_socket(port):
    """Return what asks over TCP by a bare socket."""
    connection = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    line = QUERY + b"\n"

    def ask():
        connection.sendall(line)
        heard = connection.recv(4096)
        while heard[-1:] != b"\n":
            more = connection.recv(4096)
            if not more:
                raise ConnectionError("hung up")
            heard += more
        return heard

    return ask


def by_pyserial(device):
    """Return what asks a terminal by pyserial."""
    import serial  # a peer's environment has none

    port = serial.Serial(device, timeout=PATIENCE)
    line = QUERY + b"\n"

    def ask():
        port.write(line)
        return port.readline()

    return ask


def by_visa(resource, library):
    """Return what asks a VISA resource."""
    import pyvisa

    if "a7sim://" in resource:
        import a7sim  # noqa: F401 # teaches pyserial the URL
    instrument = pyvisa.ResourceManager(library).open_resource(
        resource, read_termination="\n", write_termination="\n", timeout=1000 * PATIENCE
    )
    if "a7sim://" in resource:
        instrument.write("DRIV:X -123.45")
    return lambda: instrument.query(QUERY.decode())


def main():
    ask = by_visa(*sys.argv[1:])
    print(ask(), flush=True)
    for count in sys.stdin:
        print(json.dumps(timed(ask, int(count))), flush=True)


if __name__ == "__main__":
    main()
