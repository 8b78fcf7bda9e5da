"""Names of controls in the command language: headers of elements, words of fittings."""

from collections.abc import Mapping
from types import MappingProxyType

ELEMENT_NODES: Mapping[str, str] = MappingProxyType(
    {
        "kappa": "KAPP",
        "phi": "PHI",
        "omega": "OMEG",
        "by": "BY",
        "bz": "BZ",
        "c": "PDIS",
    }
)

FITTING_NODES: Mapping[str, str] = MappingProxyType(
    {
        "dove": "DOVE",
        "triangulation": "TRI",
        "diapositive": "DIAP",
        "xcollar": "XCOL",
        "ycollar": "YCOL",
    }
)

_SHORT: Mapping[str, str] = MappingProxyType({"inside": "IN", "outside": "OUT", "front": "FRON", "right": "RIGH"})


def short_form(position: str) -> str:
    """Return the short form of a position of a fitting or of the base."""
    return _SHORT.get(position, position.upper())


def header(element: str) -> str:
    """Return the header of an element such as kappa1 or bx."""
    if element == "bx":
        return "BASE:BX"
    if element == "common_phi":
        return "COMM:PHI"
    return f"PROJ{element[-1]}:{ELEMENT_NODES[element[:-1]]}"


def registration_word(element: str) -> str:
    """Return the word under which an element is registered, such as BY1."""
    if element == "common_phi":
        return "CPHI"
    return "BX" if element == "bx" else f"{ELEMENT_NODES[element[:-1]]}{element[-1]}"


def quote_text(text: str) -> str:
    """Return a text in quotes of the language."""
    doubled = text.replace('"', '""')
    return f'"{doubled}"'
