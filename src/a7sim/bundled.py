"""Scenarios, exercises and studies that come with a7sim, in an installed package or in a checkout."""

from pathlib import Path
from typing import Literal

Kind = Literal["scenarios", "exercises", "studies"]

_PACKAGE = Path(__file__).parent


def bundled_dirs(kind: Kind) -> tuple[Path, Path]:
    """Return the folders that may contain files of a kind."""
    return _PACKAGE / kind, _PACKAGE.parents[1] / kind


def bundled_names(kind: Kind) -> list[str]:
    """Return the names of all files of a kind that come with a7sim, in alphabetical order."""
    files = "*/exercise.toml" if kind == "exercises" else "*.toml"
    found = {file for folder in bundled_dirs(kind) for file in folder.glob(files)}
    return sorted({file.parent.name if kind == "exercises" else file.stem for file in found})
