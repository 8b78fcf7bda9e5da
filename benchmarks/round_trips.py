"""Clients that time round trips of one query, with the same code for all servers.

As a program, a VISA client in a separate process: `python round_trips.py RESOURCE LIBRARY` prints the first answer,
then for each number n on standard input the times in s of n round trips as a JSON list. It needs only pyvisa.
"""

import json
import socket
import sys
import time

QUERY = b"COUN:X?"
PATIENCE = 5.0
"""s."""


def timed(ask, count):
    """Return the times in s of `count` consecutive round trips."""
    took = []
    for _ in range(count):
        began = time.perf_counter()
        ask()
        took.append(time.perf_counter() - began)
    return took


def by_socket(port):
    """Return the query function over TCP by a raw socket."""
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
    """Return the query function of a terminal by pyserial."""
    import serial  # a peer's environment has none

    port = serial.Serial(device, timeout=PATIENCE)
    line = QUERY + b"\n"

    def ask():
        port.write(line)
        return port.readline()

    return ask


def by_visa(resource, library):
    """Return the query function of a VISA resource."""
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
