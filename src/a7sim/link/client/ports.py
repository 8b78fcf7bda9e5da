"""Opening whatever a URL names as a pyserial port, and saying clearly why it cannot be."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import serial

from a7sim.errors import A7SimError

URL_FORMS = "a7sim://SCENARIO?seed=N, tcp://HOST:PORT, rfc2217://HOST:PORT, or the path of a device or pty"

MAX_PORT = 65535

TIMEOUT_S = 5.0
"""How long a reply is waited for, unless somebody says otherwise."""

_ADDRESS = re.compile(r"[^/\\]+:[0-9]{1,5}")
"""HOST:PORT, which wants a scheme: no device or pty has such a name."""

_URL = re.compile(r"a7sim://.+|(tcp|socket|rfc2217)://(\[[0-9a-f:.%]+\]|[^/:?#\[\]]+):([0-9]{1,5})/?", re.IGNORECASE)


def open_port(url: str, timeout: float = TIMEOUT_S) -> Any:
    """Return the pyserial port that a URL names, open, its reads ending after `timeout` s.

    `socket://` is pyserial's name of `tcp://`. Raises Mistake in one sentence where it cannot be opened.
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
    """Turn what goes wrong on a line that was open into a sentence that names it. Raises Mistake."""
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
    """Return what the operating system said, if it is at the bottom of an error, else what the error says."""
    cause: BaseException | None = error
    while cause is not None:
        if len(cause.args) == 2 and isinstance(cause.args[1], str) and not isinstance(cause, serial.SerialException):
            return cause.args[1].lower()
        cause = cause.__cause__ or cause.__context__
    return " ".join(str(error).split())
