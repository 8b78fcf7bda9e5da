"""Drums: counters with rolling digits, and bars for positions within a range."""

ROLLING_FRAMES = 3
"""Frames of a rolling digit."""


def rolling_frame(before: str, after: str, frame: int) -> str:
    """Return the reading of a drum in a frame of its movement between two readings.

    Each digit moves the short way round; signs and points change at once, and so do drums of another length.
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
    """Return a reading with a fixed number of windows before its decimals, padded at the left."""
    return reading.rjust(digits)


def bar(value: float, low: float, high: float, width: int, line: str = "─", here: str = "┃") -> str:
    """Return a bar of `width` characters with the position of a value within its range."""
    share = min(max((value - low) / (high - low), 0.0), 1.0)
    at = round(share * (width - 1))
    return line * at + here + line * (width - 1 - at)
