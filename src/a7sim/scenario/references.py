"""What the parts of a scenario must agree on, checked on the raw tables so that every mistake is named at once."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

POSITIONS = "123456abcdefghi"
"""The standard points of thesis fig. 4.1."""

LEAST_POSITIONS = "123456"


def mistakes_of_reference(raw: Mapping[str, Any], folder: Path) -> Iterator[str]:
    """Yield a sentence for everything in the tables that does not fit the rest."""
    yield from _mistakes_in_names(raw)
    yield from _mistakes_in_camera(_table(raw, "camera"))
    yield from _mistakes_in_photos(raw, folder)
    yield from _mistakes_in_models(raw)
    levels = _table(raw, "plan").get("centre_levels")
    if isinstance(levels, Sequence) and len(levels) == 2 and levels[0] == levels[1]:
        yield f"plan.centre_levels: expected two different levels, got {levels[0]} twice"


def _table(raw: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = raw.get(key)
    return value if isinstance(value, Mapping) else {}


def _tables(raw: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    value = raw.get(key)
    if not isinstance(value, Sequence) or isinstance(value, str):
        return []
    return [each if isinstance(each, Mapping) else {} for each in value]


def _mistakes_in_names(raw: Mapping[str, Any]) -> Iterator[str]:
    groups = (
        (raw, "photos", "name", ""),
        (raw, "models", "name", ""),
        (raw, "ground", "point", ""),
        (_table(raw, "camera"), "fiducials", "name", "camera."),
    )
    for table, key, field, prefix in groups:
        names = [each.get(field) for each in _tables(table, key)]
        count = Counter(name for name in names if isinstance(name, str))
        for index, name in enumerate(names):
            if isinstance(name, str) and count[name] > 1 and index != names.index(name):
                first = f"{prefix}{key}[{names.index(name)}]"
                yield f"{prefix}{key}[{index}].{field}: expected a name of its own, got {name!r} as in {first}"


def _mistakes_in_camera(camera: Mapping[str, Any]) -> Iterator[str]:
    fiducials = camera.get("fiducials")
    if isinstance(fiducials, Sequence) and len(fiducials) in (5, 6, 7):
        yield f"camera.fiducials: expected four or eight fiducials, got {len(fiducials)}"


def _mistakes_in_photos(raw: Mapping[str, Any], folder: Path) -> Iterator[str]:
    for index, photo in enumerate(_tables(raw, "photos")):
        path = f"photos[{index}]"
        if ("position" in photo) == ("measured" in photo):
            got = "both" if "position" in photo else "neither"
            yield f"{path}: expected either a position it was flown from or a measured file, got {got}"
        measured = _table(photo, "measured")
        file = measured.get("file")
        if isinstance(file, str) and not (folder / file).is_file():
            yield f"{path}.measured.file: expected a file beside the scenario, got {file!r}, which is not there"


def _mistakes_in_models(raw: Mapping[str, Any]) -> Iterator[str]:
    photos = {photo.get("name"): photo for photo in _tables(raw, "photos")}
    known = ", ".join(str(name) for name in photos)
    for index, model in enumerate(_tables(raw, "models")):
        path = f"models[{index}]"
        sides = [model.get("left"), model.get("right")]
        for side, name in zip(("left", "right"), sides, strict=True):
            if isinstance(name, str) and name not in photos:
                yield f"{path}.{side}: expected a photograph of this scenario ({known}), got {name!r}"
        if isinstance(sides[0], str) and sides[0] == sides[1]:
            yield f"{path}: expected two photographs, got {sides[0]!r} on both sides"
        positions = model.get("standard_points")
        if isinstance(positions, Mapping):
            yield from _mistakes_in_positions(positions, f"{path}.standard_points")
        elif any("measured" in photos.get(name, {}) for name in sides):
            yield f"{path}.standard_points: expected point names for positions 1 to 6, got nothing"


def _mistakes_in_positions(positions: Mapping[str, Any], path: str) -> Iterator[str]:
    for label in positions:
        if label not in POSITIONS or len(label) != 1:
            yield f"{path}.{label}: expected a position 1 to 6 or a to i, got {label!r}"
    missing = [label for label in LEAST_POSITIONS if label not in positions]
    if missing:
        yield f"{path}: expected all of the positions 1 to 6, got none for {', '.join(missing)}"
