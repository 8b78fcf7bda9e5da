"""Finding a line of a journal: by number, by time, by the text of a note."""

import re
from bisect import bisect_left

from a7sim.journal.format import JournalFile

_TIME = re.compile(r"(?:(?:(\d+):)?(\d+):)?(\d+(?:\.\d*)?)s?")


def find_line(journalled: JournalFile, words: str) -> int | None:
    """Return the line of @LINE, of a time (s, or h:mm:ss) or of the text of a note, None if there is none."""
    numbers = range(2, len(journalled) + 1)
    found: int | None = None
    if words.startswith("@") and words[1:].isdecimal():
        found = int(words[1:])
    elif time_match := _TIME.fullmatch(words):
        hours, minutes, seconds = (float(each or 0) for each in time_match.groups())
        at = 3600.0 * hours + 60.0 * minutes + seconds
        found = 2 + bisect_left(numbers, at, key=lambda number: journalled.event(number).t)
    else:
        notes = (n for n in numbers if _is_note(journalled.event(n).text, words))
        found = next(notes, None)
    return found if found is not None and found in numbers else None


def _is_note(text: str, words_of_note: str) -> bool:
    return text.upper().startswith("NOTE") and words_of_note.lower() in text.lower()
