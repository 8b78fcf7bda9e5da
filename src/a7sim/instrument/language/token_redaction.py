"""Redaction of tokens in lines that are reported to others: only whether the token was right is kept."""

import hmac
import re

from a7sim.instrument.language.syntax import split_units

TOKEN_PLACEHOLDER = "(the token)"
"""Placeholder of the token, valid as the token of a replayed instrument."""

_ANOTHER, _SECRET = "(not the token)", "(kept secret)"

_LOGIN = re.compile(r"LOG(IN)?\s", re.IGNORECASE)
_HEADER = re.compile(r"[\s:A-Z0-9_]*LOG(?:IN)?\s+", re.IGNORECASE)
_QUOTED = re.compile(r"\"((?:[^\"]|\"\")*)\"\s*|'((?:[^']|'')*)'\s*")


def redact_token(text: str, token: str | None) -> str:
    """Return a line without the token in it; None if it cannot be found and all may be the token."""
    return ";".join(_replacement(unit, token) for unit in split_units(text)) if _LOGIN.search(text) else text


def _replacement(unit: str, token: str | None) -> str:
    header = _HEADER.match(unit)
    if header is None:
        return _SECRET if _LOGIN.search(unit) and (unit.count('"') % 2 or unit.count("'") % 2) else unit
    quoted = _QUOTED.fullmatch(unit, header.end())
    if quoted is None:
        return f"{header[0]}{_SECRET}"
    given = quoted[1].replace('""', '"') if quoted[1] is not None else quoted[2].replace("''", "'")
    right = token is None or hmac.compare_digest(given.encode(), token.encode())
    return f'{header[0]}"{TOKEN_PLACEHOLDER if right else _ANOTHER}"'
