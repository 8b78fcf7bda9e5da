"""Names and writing of the files of a session."""

from collections.abc import Iterable
from pathlib import Path

from a7sim.errors import A7SimError

JOURNAL, STATES, TORN = "session.jsonl", "session.states.jsonl", "session.jsonl.torn"
SCENARIO_SUFFIX = ".scenario.json"
"""Suffix of the scenario beside a journal, in place of its own suffix."""
BOOK, MODELS, STRIP, RESULTS = "book.csv", "models.csv", "strip.csv", "results.json"
CARDS, OUTPUT_CARDS, CARD_KEY = "strip.crd", "strip-output.crd", "strip-numbers.csv"
STRIPS = "strips.csv"
GEOJSON, SVG = "map.geojson", "map.svg"
RESIDUALS = "residuals.csv"
REPORT = "report.html"
MODELS_OF_WAY, STRIP_OF_WAY = "{}-models.csv", "{}-strip.csv"
METHODS = ("comparator", "A8", "bridge")
FILES = (
    JOURNAL,
    Path(JOURNAL).with_suffix(SCENARIO_SUFFIX).name,
    STATES,
    TORN,
    BOOK,
    MODELS,
    STRIP,
    CARDS,
    OUTPUT_CARDS,
    CARD_KEY,
    STRIPS,
    RESIDUALS,
    GEOJSON,
    SVG,
    REPORT,
    RESULTS,
    *(name.format(way.lower()) for way in METHODS for name in (MODELS_OF_WAY, STRIP_OF_WAY)),
)


def prepare_folder(out: Path, force: bool, parts: Iterable[str] = ()) -> None:
    """Create a folder for a session's files, without those of its parts.

    Raises A7SimError if it exists, unless forced.
    """
    try:
        if out.exists() and not out.is_dir():
            raise A7SimError(f"{out}: expected a folder, got a file")
        if out.exists() and not force:
            raise A7SimError(
                f"{out}: expected a folder that does not exist yet, got one that does (--force writes into it)"
            )
        out.mkdir(parents=True, exist_ok=True)
        for folder in (out, *(out / part for part in parts)):
            for name in FILES:
                (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise A7SimError(f"{str(out)[:200]}: expected a folder that can be written: {error.strerror}") from error


def write_atomic(path: Path, text: str) -> None:
    """Write a file atomically."""
    temporary = path.with_name(path.name + ".part")
    try:
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
