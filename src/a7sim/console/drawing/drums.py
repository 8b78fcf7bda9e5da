"""Drums: counters whose digits roll, and bars that show where in its range an element stands."""

ROLLING_FRAMES = 3
"""A turned digit passes through its neighbours in so many frames, then stands still."""


def rolling_frame(before: str, after: str, frame: int) -> str:
    """Return what a drum shows so many frames after it was turned from one reading to another.

    Every digit goes the short way round; signs and points change at once, and so do drums of another length.
    """
    if frame >= ROLLING_FRAMES or len(before) != len(after):
        return after
    return "".join(_passing(old, new, frame) for old, new in zip(before, after, strict=True))


def _passing(old: str, new: str, frame: int) -> str:
    if not (old.isdigit() and new.isdigit()):
        return new
    way = (int(new) - int(old) + 5) % 10 - 5
    return str((int(old) + round(way * frame / ROLLING_FRAMES)) % 10)


def digit_windows(reading: str, digits: int) -> str:
    """Return a reading set into so many windows before its decimals, padded at the left."""
    return reading.rjust(digits)


def bar(value: float, low: float, high: float, width: int, line: str = "─", here: str = "┃") -> str:
    """Return a bar of so many characters that shows where a value stands between the ends of its range."""
    share = min(max((value - low) / (high - low), 0.0), 1.0)
    at = round(share * (width - 1))
    return line * at + here + line * (width - 1 - at)
