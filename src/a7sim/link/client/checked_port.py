"""A line to a served instrument, beside which a twin in this process hears the same lines."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from a7sim.errors import A7SimError
from a7sim.link.client.client import Client, Port
from a7sim.link.client.exchange import send_line
from a7sim.link.client.ports import open_port, port_errors
from a7sim.link.inprocess import InProcessSerial


class TwinCheckedPort:
    """A port whose replies are the served instrument's, checked against those of its twin.

    Whoever holds it gets only what was served; the twin says whether a reply is due, and what the scenario makes of
    it. Raises Mistake where the two differ.
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
        """Return the served reply, nothing at once where none is due. Raises Mistake."""
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
    """Return about 80 printable characters, those around a place where there are more."""
    text = "".join(c if " " <= c <= "~" else "?" for c in data.decode("latin-1").strip())
    begins = max(0, around - 40)
    return ("..." if begins else "") + text[begins : begins + 80] + ("..." if begins + 80 < len(text) else "")


@contextmanager
def open_checked_port(url: str, timeout: float, token: str | None = None) -> Iterator[Any]:
    """Yield the port of a served instrument, its lock held. Raises Mistake, also when the line breaks."""
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
