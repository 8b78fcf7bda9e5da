"""Port of a served instrument whose replies are compared with those of a reference instrument in process."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from a7sim.errors import A7SimError
from a7sim.link.client.client import Client, Port
from a7sim.link.client.exchange import send_line
from a7sim.link.client.ports import open_port, port_errors
from a7sim.link.inprocess import InProcessSerial


class TwinCheckedPort:
    """Port with the replies of the served instrument, checked against those of a reference instrument.

    The caller gets only the served replies; the reference instrument tells whether a reply is due. Raises A7SimError if
    the two differ.
    """

    def __init__(self, served: Port, twin: InProcessSerial, url: str) -> None:
        self._served = served
        self._twin = twin
        self._url = url
        self._sent = b""

    def write(self, data: bytes, /) -> int | None:
        """Send bytes to both."""
        self._sent = data
        self._twin.write(data)
        return self._served.write(data)

    def readline(self, size: int | None = -1, /) -> bytes:
        """Return the served reply, immediately empty if none is due. Raises A7SimError."""
        if not self._twin.in_waiting:
            return b""
        due = self._twin.readline(size)
        served = self._served.readline(size)
        if served != due:
            raise A7SimError(f"{self._url}: {_difference(self._sent, served, due)}")
        return served


def _difference(sent: bytes, served: bytes, due: bytes) -> str:
    if due.startswith(served):
        return f"expected an answer to {_shown(sent)} in time, got {_shown(served) or 'none'}"
    same = next(
        i for i, (of_served, of_twin) in enumerate(zip(served, due + b"\0", strict=False)) if of_served != of_twin
    )
    return (
        "the instrument served is not a new one of this scenario and seed (serve it anew); "
        f"expected {_shown(due, same)} in answer to {_shown(sent)}, got {_shown(served, same)}"
    )


def _shown(data: bytes, around: int = 0) -> str:
    """Return about 80 printable characters around a position."""
    text = "".join(c if " " <= c <= "~" else "?" for c in data.decode("latin-1").strip())
    begins = max(0, around - 40)
    return ("..." if begins else "") + text[begins : begins + 80] + ("..." if begins + 80 < len(text) else "")


@contextmanager
def open_checked_port(url: str, timeout: float, token: str | None = None) -> Iterator[Any]:
    """Yield the port of a served instrument with its lock held. Raises A7SimError, also if the connection breaks."""
    port = open_port(url, timeout)
    try:
        with port_errors(url):
            client = Client(port)
            if token is not None:
                client.log_in(token)
            if send_line(client, "SYST:LOCK:REQ?").shown != "1":
                raise A7SimError(f"{url}: expected the instrument to be free, but another client holds its lock")
            yield port
            client.send("SYST:LOCK:REL;*OPC?")
            client.reply()
    finally:
        port.close()
