"""Chapters of a report, by the kind of session."""

import base64
import html
from collections.abc import Callable, Iterator
from pathlib import Path

from rich.text import Text

from a7sim.journal.session_files import RESIDUALS, STRIP, STRIP_OF_WAY, SVG
from a7sim.reduction.strips import is_centre
from a7sim.report import session_tables
from a7sim.report.figures.grid import grid_residuals
from a7sim.report.figures.model import (
    centre_residuals,
    iterations,
    parallax_table,
    perspective_centre,
    residual_parallaxes,
)
from a7sim.report.figures.sessions import all_strips, hours
from a7sim.report.figures.strip import Places, plan_and_profile, residuals_in_height, residuals_in_plan
from a7sim.report.forms import make_forms
from a7sim.report.map_tables import map_tables
from a7sim.report.page import Chapter, Details, PageFigure, Part, TableBlock
from a7sim.report.pointing_rays import pointing_rays
from a7sim.report.session_folder import SessionFolder
from a7sim.report.terminal import terminal_parts
from a7sim.result_documents import Document
from a7sim.session.bridge import INDEPENDENT
from a7sim.session.bridge import bridge_tables as of_bridge
from a7sim.session.grid_test import report_tables as of_grid_test

Chapters = Iterator[Chapter]


def make_chapters(kept: SessionFolder) -> Chapters:
    """Yield the chapters for the contents of a folder."""
    yield from _OF_COMMAND[kept.command](kept)
    yield from _of_operator(kept)
    yield from _of_forms(kept)
    yield _of_settings(kept)


def _of_run(kept: SessionFolder) -> Chapters:
    document = kept.document
    for i, model in enumerate(document.get("models", ())):
        yield _of_model(kept, model, f"m{i}")
    if "strips" in document:
        yield _of_all_strips(document)
    if "strip" in document:
        yield _of_strip(document["strip"], _places(kept, STRIP), "Strip", "s")
    for name, strip in document.get("ways", {}).items():
        yield _of_strip(strip, _places(kept, STRIP_OF_WAY.format(name.lower())), f"Strip, {name}", f"w{name}")
    if "a8_minus_comparator_m" in document:
        each = session_tables.accuracy_table({"points": document["a8_minus_comparator_m"]})
        yield Chapter("A8 minus comparator", list(terminal_parts(each, caption="A8 minus comparator, m")))


def _of_model(kept: SessionFolder, model: Document, name: str) -> Chapter:
    orientation = model["relative_orientation"]
    title = f"Model {model['model']}: {model['left']} and {model['right']}, base {model['base']}"
    parts: list[Part] = [residual_parallaxes(model, f"{name}p")]
    if orientation["rounds"]:
        parts.append(iterations(model, f"{name}i"))
    parts += terminal_parts(session_tables.rounds_table(orientation))
    parts += [Details("Residual y-parallaxes in a table", [parallax_table(model)])]
    parts += terminal_parts(session_tables.elements_table(orientation["elements"], model["truth"].get("elements", {})))
    rays = {side: pointing_rays(kept, model, side) for side in model["perspective_centres"]}
    parts += [perspective_centre(model, side, rays[side], f"{name}c{side}") for side in rays]
    parts += terminal_parts(session_tables.centres_table(model))
    missed = centre_residuals(model, rays)
    if missed is not None:
        parts.append(Details("Rays of the points beside the centres", [missed]))
    if "absolute_orientation" in model:
        parts += terminal_parts(session_tables.ground_table(model["absolute_orientation"]))
    parts += terminal_parts(session_tables.truth_table(model["truth"]))
    return Chapter(title, parts)


def _of_strip(strip: Document, places: Places, title: str, name: str) -> Chapter:
    shown = [] if "message" in strip else _strip_figures(strip, places, title, name)
    return Chapter(title, [*shown, *terminal_parts(*session_tables.strip_tables(strip), caption=title)])


def _strip_figures(strip: Document, places: Places, title: str, name: str) -> list[Part]:
    figures = (
        residuals_in_plan(strip, places, f"{name}p", title),
        residuals_in_height(strip, f"{name}h", title),
        plan_and_profile(places, strip, f"{name}s", title),
    )
    return [figure for figure in figures if figure is not None]


def _of_all_strips(document: Document) -> Chapter:
    figures = [all_strips(document["strips"], "all")] if document["strips"] else []
    spent = {f"case {case}": each["hours"] for case, each in document["sessions"].items()}
    times = [hours(spent, "cases", "Hours at the instrument by case")] if spent else []
    return Chapter("Strips of all cases", [*figures, *terminal_parts(session_tables.strips_table(document)), *times])


def _of_calibration(kept: SessionFolder) -> Chapters:
    rows = kept.rows(RESIDUALS)
    figures = [grid_residuals(rows, side, f"g{side}") for side in kept.document["projectors"]]
    yield Chapter("Grid test", [*(each for each in figures if each), *terminal_parts(of_grid_test(kept.document))])


def _of_compilation(kept: SessionFolder) -> Chapters:
    document = kept.document
    drawn = kept.text(SVG)
    sheet = [_map(drawn, f"Map of model {document['model']}")] if drawn else []
    yield Chapter("Map", [*sheet, *terminal_parts(map_tables(document), caption="Lines beside the true ground")])
    if "levelling" in document:
        yield _of_strip(document["levelling"] | {"joins": []}, {}, "Levelling on the ground control", "l")


def _map(svg: str, title: str) -> PageFigure:
    """Return a map as an isolated image, whose styles do not affect the page."""
    data = base64.b64encode(svg.encode()).decode()
    return PageFigure(f'<img src="data:image/svg+xml;base64,{data}" alt="{html.escape(title)}">', title, wide=True)


def _of_bridge(kept: SessionFolder) -> Chapters:
    document = kept.document
    yield Chapter("Bridge", list(terminal_parts(of_bridge(document), caption="Bridged models")))
    independent = _places(kept, f"{INDEPENDENT}/{STRIP}")
    ground = {point: at for point, at in independent.items() if not is_centre(point)}
    for way, places in (("bridged", ground), (INDEPENDENT, independent)):
        strip = document.get(way, {}).get("strip", {})
        if "residuals_m" in strip:
            yield _of_strip({"joins": []} | strip, places, f"Strip, {way}", f"b{way}")


def _of_operator(kept: SessionFolder) -> Chapters:
    operator = kept.document.get("operator")
    if operator is None:
        return
    parts: list[Part] = []
    for key, title in (
        ("time_by_activity_h", "Time by activity"),
        ("time_by_act_h", "Time by what the hands and eyes did"),
    ):
        if operator[key]:
            parts.append(hours(operator[key], key, title))
    for key, title in (("time_by_activity_h", "Hours by activity"), ("time_by_act_h", "Hours by act")):
        parts.append(
            TableBlock(
                title,
                (title.removeprefix("Hours by "), "hours"),
                [(what, f"{each:.4f}") for what, each in operator[key].items()],
            )
        )
    parts += terminal_parts(session_tables.hours_table(operator))
    parts += terminal_parts(*(Text(remark) for remark in operator["remarks"]))
    slips = kept.document["truth"]["slips"]
    if slips:
        parts.append(Details(f"What the operator did wrongly without knowing: {len(slips)}", [_slips(slips)]))
    yield Chapter("Time at the instrument", parts)


def _slips(slips: list[Document]) -> TableBlock:
    columns = tuple(slips[0])
    rows = [["" if each[key] is None else str(each[key]) for key in columns] for each in slips]
    return TableBlock("Slips", columns, rows, frozenset({2, 4, 5, 6}))


def _of_forms(kept: SessionFolder) -> Chapters:
    forms = [Details(form.caption, form.as_parts()) for form in make_forms(kept) if form.columns]
    if forms:
        yield Chapter("Observation book", list(forms))


_SETTINGS = (
    "command_line",
    "scenario",
    "seed",
    "software",
    "variant",
    "serial",
    "work",
    "method",
    "case",
    "schema_version",
)


def _of_settings(kept: SessionFolder) -> Chapter:
    document = kept.document
    rows = [(key.replace("_", " "), _words(document[key])) for key in _SETTINGS if key in document]
    changed = [(path, value) for path, value in document.get("settings", {}).items()]
    parts: list[Part] = [TableBlock("What gives this session again", ("what", "value"), rows, frozenset({0, 1}))]
    if changed:
        parts.append(TableBlock("Changed in the scenario's file", ("setting", "value"), changed, frozenset({0, 1})))
    files = sorted(path.name for path in Path(kept.folder).iterdir())
    parts.append(
        TableBlock("Files in the folder", ("file", "bytes"), [(name, _size(kept.folder / name)) for name in files])
    )
    return Chapter("Settings", parts)


def _words(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _size(path: Path) -> str:
    return "folder" if path.is_dir() else f"{path.stat().st_size}"


def _places(kept: SessionFolder, name: str) -> dict[str, tuple[float, float, float]]:
    return {row["point"]: (float(row["X"]), float(row["Y"]), float(row["Z"])) for row in kept.rows(name)}


_OF_COMMAND: dict[str, Callable[[SessionFolder], Chapters]] = {
    "run": _of_run,
    "calibrate": _of_calibration,
    "compile": _of_compilation,
    "bridge": _of_bridge,
}
