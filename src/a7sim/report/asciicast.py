"""Asciicast version 2 of a session, with a marker at each model and form."""

import io
from collections.abc import Iterator
from dataclasses import dataclass

import msgspec
from rich.console import Console, Group, RenderableType
from rich.text import Text

from a7sim.errors import A7SimError
from a7sim.journal.format import read_journal
from a7sim.journal.session_files import JOURNAL
from a7sim.operator.people.observation_book import BookEntry
from a7sim.report import session_tables
from a7sim.report.map_tables import map_tables
from a7sim.report.session_folder import SessionFolder
from a7sim.session.bridge import bridge_tables as of_bridge
from a7sim.session.grid_test import report_tables as of_grid_test

COLUMNS, LINES = 100, 32

MAX_PAUSE_S = 2.0
"""Maximum pause in s of the playback."""

_NOTE = 'NOTE "'


@dataclass(frozen=True)
class CastLine:
    """Output at a simulated time, s; a marker at the start of a model or a form."""

    time: float
    text: str
    marker: str = ""


def make_cast(kept: SessionFolder, speed: float) -> str:
    """Return the asciicast of a session with simulated time `speed` times as fast. Raises A7SimError."""
    with kept.reading_results():
        lines = sorted(_lines(kept), key=lambda line: line.time)
    header = {
        "version": 2,
        "width": COLUMNS,
        "height": LINES,
        "duration": round(max((line.time for line in lines), default=0.0) / speed, 6),
        "idle_time_limit": MAX_PAUSE_S,
        "title": f"a7sim: {kept.document['scenario']}, seed {kept.document['seed']}",
        "env": {"TERM": "xterm-256color"},
    }
    if "command_line" in kept.document:
        header["command"] = kept.document["command_line"]
    events = (event for line in lines for event in _events(line, speed))
    return "".join(f"{msgspec.json.encode(each).decode()}\n" for each in (header, *events))


def _events(line: CastLine, speed: float) -> Iterator[tuple[float, str, str]]:
    time = round(line.time / speed, 6)
    if line.marker:
        yield time, "m", line.marker
    yield time, "o", line.text.replace("\n", "\r\n")


def _lines(kept: SessionFolder) -> Iterator[CastLine]:
    document = kept.document
    yield CastLine(0.0, f"$ {document.get('command_line', 'a7sim ' + kept.command)}\n")
    notes = list(_notes(kept))
    if not notes and not kept.book:
        raise A7SimError(
            f"{kept.folder}: expected the journal or the book of an operator to make a film of, "
            "got a session with neither"
        )
    yield from notes
    yield from (_reading(entry) for entry in kept.book if entry.reading or not notes)
    for model in document.get("models", ()):
        yield CastLine(model["finished_at_s"], _printed(Group(*session_tables.model_tables(model))))
    yield CastLine(3600.0 * document["operator"]["hours"], _printed(_end(kept)))


def _notes(kept: SessionFolder) -> Iterator[CastLine]:
    """Yield the operator's notes in the journal: starts of forms, and remarks."""
    models, forms, remarks = ({getattr(entry, name) for entry in kept.book} for name in ("model", "form", "remark"))
    path = kept.folder / JOURNAL
    if not path.is_file():
        return
    journalled = read_journal(path)
    for number in range(2, len(journalled) + 1):
        event = journalled.event(number)
        if event.dir == ">" and event.text.startswith(_NOTE):
            note = event.text.removeprefix(_NOTE).removesuffix('"').replace('""', '"')
            begins = note in forms or (note.partition(": ")[0] in models and note not in remarks)
            yield CastLine(event.t, f"\x1b[1m{_clock(event.t)} {note}\x1b[0m\n", note if begins else "")


def _reading(entry: BookEntry) -> CastLine:
    struck = f"  \x1b[9m{entry.reading}\x1b[0m {entry.struck}" if entry.struck else f"  {entry.reading}"
    words = entry.remark if entry.item == "remark" else f"{entry.point:<10}{entry.item:<28}{struck}"
    return CastLine(entry.time, f"{_clock(entry.time)}   {words.rstrip()}\n")


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 3600:02d}:{int(seconds) // 60 % 60:02d}:{int(seconds) % 60:02d}"


def _end(kept: SessionFolder) -> RenderableType:
    """Return the final output of the command without the models, which are already shown."""
    document = kept.document
    if kept.command == "run":
        return session_tables.session_tables({**document, "models": ()})
    shown: RenderableType = {"calibrate": of_grid_test, "compile": map_tables, "bridge": of_bridge}[kept.command](
        document
    )
    return Group(shown, Text())


def _printed(shown: RenderableType) -> str:
    out = io.StringIO()
    console = Console(file=out, width=COLUMNS, force_terminal=True, color_system="standard", legacy_windows=False)
    console.print(shown)
    return out.getvalue()
