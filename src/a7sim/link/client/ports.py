"""Opening of pyserial ports by URL, with clear error messages."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import serial

from a7sim.errors import A7SimError

URL_FORMS = "a7sim://SCENARIO?seed=N, tcp://HOST:PORT, rfc2217://HOST:PORT, or the path of a device or pty"

MAX_PORT = 65535

TIMEOUT_S = 5.0
"""Default wait for a reply in s."""

_ADDRESS = re.compile(r"[^/\\]+:[0-9]{1,5}")
"""HOST:PORT without a scheme: no device or pty has such a name."""

_URL = re.compile(r"a7sim://.+|(tcp|socket|rfc2217)://(\[[0-9a-f:.%]+\]|[^/:?#\[\]]+):([0-9]{1,5})/?", re.IGNORECASE)


def open_port(url: str, timeout: float = TIMEOUT_S) -> Any:
    """Return the open pyserial port of a URL, with a read timeout in s.

    `socket://` is pyserial's name of `tcp://`. Raises A7SimError if it cannot be opened.
    """
    if not _is_named(url):
        raise A7SimError(f"expected {URL_FORMS}, got {url!r}")
    named = re.sub("^socket://", "tcp://", url, flags=re.IGNORECASE)
    try:
        return serial.serial_for_url(named, timeout=timeout)
    except (OSError, ValueError) as error:
        raise A7SimError(f"{url}: expected an instrument to answer there: {_reason(error)}") from error


@contextmanager
def port_errors(url: str) -> Iterator[None]:
    """Convert exceptions of an open port into an error that names it. Raises A7SimError."""
    try:
        yield
    except serial.SerialException as error:
        raise A7SimError(f"{url}: the line broke: {_reason(error)}") from error


def _is_named(url: str) -> bool:
    if "://" not in url:
        return url != "" and not _ADDRESS.fullmatch(url)
    found = _URL.fullmatch(url)
    return found is not None and (found[3] is None or int(found[3]) <= MAX_PORT)


def _reason(error: BaseException) -> str:
    """Return the operating system's message in an error, otherwise the error's own."""
    cause: BaseException | None = error
    while cause is not None:
        if len(cause.args) == 2 and isinstance(cause.args[1], str) and not isinstance(cause, serial.SerialException):
            return cause.args[1].lower()
        cause = cause.__cause__ or cause.__context__
    return " ".join(str(error).split())
