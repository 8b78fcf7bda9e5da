"""How a count is said: 1 reading, 2 readings."""


def pluralize(number: float, one: str, many: str | None = None) -> str:
    """Return a number with what is counted; `many` where it is not `one` with an s.

    >>> counted(1, "reading"), counted(0, "reading"), counted(2, "cross", "crosses")
    ('1 reading', '0 readings', '2 crosses')
    """
    shown = f"{number:g}" if isinstance(number, float) else str(number)
    return f"{shown} {one if number == 1 else many or f'{one}s'}"
