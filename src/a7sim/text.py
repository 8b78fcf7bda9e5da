"""Numbers with nouns: 1 reading, 2 readings."""


def pluralize(number: float, one: str, many: str | None = None) -> str:
    """Return a number with its noun; `many` is the plural, by default `one` with an s.

    >>> pluralize(1, "reading"), pluralize(0, "reading"), pluralize(2, "cross", "crosses")
    ('1 reading', '0 readings', '2 crosses')
    """
    shown = f"{number:g}" if isinstance(number, float) else str(number)
    return f"{shown} {one if number == 1 else many or f'{one}s'}"
