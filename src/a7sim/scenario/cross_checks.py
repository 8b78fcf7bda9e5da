"""Checks between the parts of a scenario, on the raw tables, so that all errors are reported together."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from a7sim.standard_points import POSITIONS, determine_orientation

MIN_SEPARATION = 1.0
"""Minimum distance of the two levels of a perspective centre, counter units."""

MAX_CROSS_MM = 110.0
"""Maximum along either axis: the plate is a picture of 230 mm with a margin."""

MIN_IN_PLAN, MIN_IN_HEIGHT = 2, 3
"""Control points needed to orient a strip on the ground (S)."""


def cross_check_errors(raw: Mapping[str, Any], folder: Path) -> Iterator[str]:
    """Yield a sentence for each value in the tables that contradicts another."""
    yield from _mistakes_in_names(raw)
    yield from _mistakes_in_camera(_table(raw, "camera"))
    yield from _mistakes_in_photos(raw, folder)
    yield from _mistakes_in_models(raw)
    yield from _mistakes_in_slips(raw)
    yield from _mistakes_in_levels(_table(raw, "plan"))
    yield from _mistakes_in_grid_plate(raw)
    yield from _mistakes_in_work(raw)
    yield from _mistakes_in_control(raw)
    if _table(raw, "instrument").get("variant") == "A8":
        yield from _mistakes_with_an_a8(raw)
    elif "grid_test" in _table(raw, "instrument"):
        yield "instrument.grid_test: expected variant = 'A8' beside it; the faults of an A7 stand in condition"


def _mistakes_in_levels(plan: Mapping[str, Any]) -> Iterator[str]:
    levels = plan.get("centre_levels", [])
    if not isinstance(levels, Sequence) or not all(isinstance(each, int | float) for each in levels):
        return
    method = plan.get("centre_method", "two levels")
    if method == "two levels" and len(levels) > 2:
        yield f"plan.centre_levels: expected two levels, got {len(levels)} (centre_method = 'levels' takes more)"
    for low, high in pairwise(sorted(levels)):
        if high - low < MIN_SEPARATION:
            yield f"plan.centre_levels: expected levels {MIN_SEPARATION:g} or more apart, got {low:g} and {high:g}"


def _mistakes_in_grid_plate(raw: Mapping[str, Any]) -> Iterator[str]:
    plate = _table(raw, "grid_plate")
    outermost = (_number(plate.get("lines"), 9) - 1.0) / 2.0 * _number(plate.get("spacing_mm"), 25.0)
    if outermost > MAX_CROSS_MM:
        yield (
            f"grid_plate.spacing_mm: expected crosses within {MAX_CROSS_MM:g} mm of the middle, got {outermost:g} mm"
        )
    name = plate.get("name", "grid")
    for index, photo in enumerate(_tables(raw, "photos")):
        if photo.get("name") == name:
            yield f"photos[{index}].name: expected another name than that of the grid plate, got {name!r}"


def _mistakes_in_slips(raw: Mapping[str, Any]) -> Iterator[str]:
    models = [str(model.get("name")) for model in _tables(raw, "models")]
    for index, slip in enumerate(_tables(_table(raw, "observer"), "certain_slips")):
        if slip.get("model", "") not in ("", *models):
            path = f"observer.certain_slips[{index}].model"
            yield f"{path}: expected the name of a model ({', '.join(models)}), got {slip['model']!r}"


def _ways(raw: Mapping[str, Any]) -> list[object]:
    work = raw.get("work", ["plotter"])
    return list(work) if isinstance(work, list) else []


def _mistakes_in_work(raw: Mapping[str, Any]) -> Iterator[str]:
    ways = _ways(raw)
    for index, way in enumerate(ways):
        if way in ways[:index]:
            yield f"work[{index}]: expected every way once, got {way!r} twice"
    if "bridge" in ways and {model.get("base", "inside") for model in _tables(raw, "models")} != {"inside", "outside"}:
        yield "models: expected base inside and outside in turn, as bridging needs, got one of them alone"
    if {"plotter", "readings", "bridge"} & {*map(str, ways)} and "plan" not in raw:
        yield "plan: expected the settings of the plotter, got nothing (work = ['comparator'] needs none)"


def _mistakes_in_control(raw: Mapping[str, Any]) -> Iterator[str]:
    """Yield the control that a strip lacks: for absolute orientation by seven equations (S), and for its polynomial."""
    roles = [point.get("role") for point in _tables(raw, "ground")]
    plan, heights = (sum(role in ("control", which) for role in roles) for which in ("plan", "height"))
    degree = _table(raw, "strip").get("polynomial")
    if degree in (2, 3) and (plan < degree + 1 or heights < 2 * degree + 1):
        yield (
            f"strip.polynomial: expected {degree + 1} points of ground control in plan and {2 * degree + 1} in height "
            f"for degree {degree}, got {plan} and {heights}"
        )
    elif "comparator" in _ways(raw) and (plan < MIN_IN_PLAN or heights < MIN_IN_HEIGHT):
        yield (
            f"ground: expected {MIN_IN_PLAN} points of control in plan and {MIN_IN_HEIGHT} in height for a "
            f"strip by comparator, got {plan} and {heights}"
        )


def _mistakes_with_an_a8(raw: Mapping[str, Any]) -> Iterator[str]:
    method = _table(raw, "plan").get("method", "independent")
    if method != "independent":
        yield f"plan.method: expected 'independent' on an A8, which has neither by nor bz, got {method!r}"
    for index, model in enumerate(_tables(raw, "models")):
        base = model.get("base", "inside")
        if base != "inside":
            yield f"models[{index}].base: expected 'inside', all that an A8 has, got {base!r}"


def _table(raw: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = raw.get(key)
    return value if isinstance(value, Mapping) else {}


def _tables(raw: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    value = raw.get(key)
    if not isinstance(value, Sequence) or isinstance(value, str):
        return []
    return [each if isinstance(each, Mapping) else {} for each in value]


def _number(value: object, otherwise: float = 0.0) -> float:
    return float(value) if isinstance(value, int | float) else otherwise


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
        if "side" in measured and "photo" in measured:
            yield f"{path}.measured: expected either a side of a pair file or a photo of a photo file, got both"
        if "count_mm" in measured and measured.get("units") != "counts":
            yield f"{path}.measured.count_mm: expected units = 'counts' beside it, got {measured.get('units', 'mm')!r}"
        position, terrain = photo.get("position"), _table(raw, "terrain")
        summit = _number(terrain.get("mean_height")) + _number(terrain.get("relief"))
        if isinstance(position, Sequence) and len(position) == 3 and _number(position[2], summit + 1.0) <= summit:
            yield f"{path}.position[2]: expected a station above the terrain ({summit:g} m), got {position[2]:g}"
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
        both = [photos.get(name, {}) for name in sides if isinstance(name, str)]
        if len({str(photo.get("polarity", "positive")) for photo in both}) > 1:
            yield f"{path}: expected two positives or two negatives, got one of each"
        stations = [photo.get("position") for photo in both]
        if len(stations) == 2 and stations[0] is not None and stations[0] == stations[1]:
            yield f"{path}: expected two stations apart, got both photographs from {stations[0]}"
        base = _table(model, "published").get("base")
        if isinstance(base, Sequence) and not any(base):
            yield f"{path}.published.base: expected a vector, got zero"
        positions = model.get("standard_points")
        if isinstance(positions, Mapping):
            yield from _mistakes_in_positions(positions, f"{path}.standard_points")
        elif any("measured" in photos.get(name, {}) for name in sides):
            yield f"{path}.standard_points: expected point names for positions 1 to 6, got nothing"


def _mistakes_in_positions(positions: Mapping[str, Any], path: str) -> Iterator[str]:
    for label in positions:
        if label not in POSITIONS or len(label) != 1:
            yield f"{path}.{label}: expected a position 1 to 6 or a to i, got {label!r}"
    count = Counter(str(name) for name in positions.values())
    for label, name in positions.items():
        if count[str(name)] > 1:
            yield f"{path}.{label}: expected a point of its own, got {name!r} at {count[str(name)]} positions"
    if not determine_orientation(positions):
        got = ", ".join(label for label in POSITIONS if label in positions) or "none"
        yield f"{path}: expected a point in each of the three rows, and two or more in two of them, got {got}"
