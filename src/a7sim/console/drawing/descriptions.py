"""Descriptions in words of an image beside the mark, for screen readers and for `--plain`; errors in words."""

import re

ACUITY_UM = 10.0
"""Default acuity of the eye, um at photo scale."""


def estimate(distance: float, acuity: float) -> float:
    """Return a distance in um as estimated by an eye: rounded to its acuity, and to two figures."""
    size = max(acuity, 10.0 ** (len(str(int(abs(distance)))) - 2), 1.0)
    return round(distance / size) * size


def describe_image(seen: tuple[float, float] | None, acuity: float = ACUITY_UM) -> str:
    """Return the position of an image relative to the mark: dx, dy in um, +x right, +y up; None if not in view."""
    if seen is None:
        return "image not in the field of view"
    across, up = (estimate(each, acuity) for each in seen)
    parts = [
        *([f"{format_length(abs(across))} {'right' if across > 0 else 'left'} of"] if across else []),
        *([f"{format_length(abs(up))} {'above' if up > 0 else 'below'}"] if up else []),
    ]
    return f"image is about {' and '.join(parts)} the mark" if parts else "image is on the mark"


def describe_parallax(parallax: tuple[float, float] | None, acuity: float = ACUITY_UM) -> str:
    """Return the disagreement of the two images: px, py in um, left eye minus right eye."""
    if parallax is None:
        return "the two images cannot be compared"
    across, up = (estimate(each, acuity) for each in parallax)
    height = (
        f"left image is about {format_length(abs(up))} {'higher' if up > 0 else 'lower'}" if up else "no y-parallax"
    )
    depth = f"x-parallax about {format_length(across)}" if across else "no x-parallax"
    return f"{height}, {depth}"


def format_length(um: float) -> str:
    """Return a length in um or mm as text."""
    return f"{um / 1e3:.2g} mm" if abs(um) >= 1000.0 else f"{um:.0f} um"


def describe_error(error: str) -> str:
    """Return an entry of the instrument's error queue without number and header."""
    _, _, text = error.partition(",")
    message, _, detail = text.strip().strip('"').partition(";")
    return re.sub(r"^[A-Z]+[A-Z0-9:?]*( \S+)?: ", "", detail) or message
