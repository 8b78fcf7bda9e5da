"""Documents of reductions as tables."""

from collections.abc import Iterable, Sequence
from math import isnan
from typing import Any

from rich.table import Table

from a7sim.result_documents import Document
from a7sim.text import pluralize
from a7sim.text_tables import text_table

ANGLES = ("omega", "phi", "kappa")
SHIFTS = ("Tx", "Ty", "Tz")

Tables = list[Any]


def interior_tables(document: Document) -> Tables:
    """Return fits, residuals, and film deformations, photograph by photograph."""
    camera = document["camera"]
    tables: Tables = [
        f"Interior orientation, {document['method']}, {camera['name']}, c {camera['c_mm']:.3f} mm",
        f"points in mm about the {document['about']}{_corrections_text(document['corrections'])}",
    ]
    for picture in document["photographs"]:
        unknowns = [(name, f"{u['value']:.9g}", f"{u['sigma']:.2g}") for name, u in picture["unknowns"].items()]
        residuals = [(name, *(1e3 * v for v in each)) for name, each in picture["residuals_mm"].items()]
        tables += [
            "",
            f"Photograph {picture['photo']}: {pluralize(len(picture['points']), 'point')}, "
            f"s0 {1e3 * picture['s0_mm']:.1f} um, redundancy {picture['statistics']['redundancy']}",
            _table(("unknown", "value", "±"), unknowns),
            _table(("fiducial", "vx, um", "vy, um"), residuals, 1),
            *_film_lines(picture["film"]),
        ]
    return tables


def _corrections_text(corrections: Sequence[str]) -> str:
    return f", corrected for {', '.join(corrections)}" if corrections else ""


def _film_lines(film: Document) -> list[str]:
    x, y = film["mm_per_count"]
    lines = [f"film: {x:.9g} and {y:.9g} mm a count in x and y, axes {film['shear_gon']:.4f} gon off square"]
    if "scale" in film:
        x, y = film["shrinkage_ppm"]
        lines.append(
            f"film: shrunk by {x:.0f} and {y:.0f} ppm, principal distance for the plotter "
            f"{film['principal_distance_mm']:.3f} mm"
        )
    return lines


def relative_tables(document: Document) -> Tables:
    """Return elements, parallaxes and model coordinates; the blunders; and the methods side by side."""
    elements = [
        (name, "mm" if name.startswith("b") else "gon", each["value"], each["sigma"])
        for name, each in document["elements"].items()
    ]
    parallaxes = document["residual_y_parallax_mm"]
    points = [
        (name, *place, f"{1e3 * parallaxes[name]:.1f}" if name in parallaxes else "taken out")
        for name, place in document["points"].items()
    ]
    tables: Tables = [
        f"Relative orientation by {document['method']}",
        "",
        _table(("element", "", "value", "±"), elements),
        "",
        _table(("point", "X, mm", "Y, mm", "Z, mm", "p, um"), points),
        "",
        f"s0 {1e3 * document['s0_mm']:.2f} um in the picture, "
        f"redundancy {document['statistics']['redundancy']}, {pluralize(document['iterations'], 'iteration')}, "
        f"condition {document['condition']:.2g}",
    ]
    if document["method"] == "robust":
        tables += _blunder_lines(document)
    if "compare" in document:
        coordinates = [row for row in document["compare"]["rows"] if row["unit"] != "mm of the model"]
        tables += ["", "Side by side", _methods_table(coordinates), *_largest_difference_lines(document["compare"])]
        tables += _blunder_lines(document["robust"])
    return tables


def _blunder_lines(document: Document) -> list[str]:
    if not document["searchable"] and not document["blunders"]:
        return ["too few points to name one with a blunder: seven are the fewest"]
    return [
        f"blunder at point {each['point']}: {each['parallax_mm']:.3f} mm of y-parallax, "
        f"{abs(each['standardised']):.1f} standard deviations (critical {each['critical']:.1f})"
        for each in document["blunders"]
    ] or ["no blunders found"]


def centres_tables(document: Document) -> Tables:
    """Return centres with their precision, and the residuals of the points."""
    method = document["method"]
    tables: Tables = [f"Perspective centres, {method}", ""]
    if method == "a8":
        rows = [(name, side, *each[side]) for name, each in document["models"].items() for side in ("left", "right")]
        return [*tables, _table(("model", "centre", "X, units", "Y, units", "Z, mm"), rows, 3)]
    rows = [(name, document[name], document[f"sigma_{name}"]) for name in ("X0", "Y0", "Z0", "T0") if name in document]
    angles = [(f"{name}, gon", each["value"], each["sigma"]) for name, each in document.get("angles", {}).items()]
    names = ("vx, mm", "vy, mm") if method == "grid" else ("vX", "vY")
    tables += [
        _table(("", "value", "±"), rows + angles),
        "",
        _table(("point", *names), [(point, *v) for point, v in document["residuals"].items()]),
        "",
    ]
    if method == "grid":
        return [
            *tables,
            f"s0 {1e3 * document['s0_mm']:.2f} um on the plate, {pluralize(document['iterations'], 'iteration')}",
        ]
    pointing_text = f", a pointing {document['pointing_rms']:.4f}" if "pointing_rms" in document else ""
    return [*tables, f"rms {document['rms']:.4f}{pointing_text}, redundancy {document['redundancy']}"]


def similarity_tables(document: Document) -> Tables:
    """Return the seven unknowns, the residuals, and the methods side by side."""
    sigma = document["sigma"]
    values = {"scale": document["scale"]} | {f"{name}, gon": value for name, value in document["angles"].items()}
    values |= dict(zip(SHIFTS, document["translation"], strict=True))
    tables: Tables = [
        f"Similarity by {document['method']}",
        "",
        _table(("", "value", "±"), [(name, v, sigma[name.split(",")[0]]) for name, v in values.items()], 6),
        "",
        _table(("point", "vX", "vY", "vZ"), [(point, *v) for point, v in document["residuals"].items()]),
        "",
        f"s0 {document['s0']:.5f}, redundancy {document['statistics']['redundancy']}",
    ]
    if "compare" in document:
        comparison = document["compare"]
        tables += ["", "Side by side", _methods_table(comparison["rows"]), *_largest_difference_lines(comparison)]
    return tables


def connection_tables(document: Document) -> Tables:
    """Return the joins with their closing differences, and the points of the joined model."""
    points = [(point, *place) for point, place in document["points"].items()]
    return [
        f"Models {', '.join(document['models'])} joined on {document['method']}",
        f"in the system and unit of {document['system']}",
        "",
        *_join_tables(document["joins"], differences=True),
        "",
        _table(("point", "X", "Y", "Z"), points),
    ]


def strip_tables(document: Document) -> Tables:
    """Return joins, absolute orientation, residuals, and the deformation found by the polynomials."""
    tables: Tables = [
        f"Strip of {pluralize(len(document['models']), 'model')} from {document['input']}, "
        f"joined on {document['method']}",
        f"joins in the unit of model {document['models'][0]['model']}{', mm' if document['input'] == 'pairs' else ''}",
        "",
        *_join_tables(document["joins"]),
        "",
        *absolute_tables(document, "Absolute orientation of the strip"),
    ]
    if "polynomial" in document:
        tables += ["", *_polynomial_tables(document["polynomial"])]
    return tables


def absolute_tables(document: Document, title: str = "Absolute orientation") -> Tables:
    """Return scale, residuals and accuracies at the ground points, and differences from given coordinates."""
    precision = f", s0 {document['s0_m']:.4f} m" if "s0_m" in document else ""
    return [
        f"{title}: scale {document['absolute']['scale']:.9f}{precision}",
        *_ground_tables(document),
        *_comparison_tables(document),
    ]


def block_tables(document: Document) -> Tables:
    """Return the models' scales, the tie residuals, and the residuals and accuracies at the ground points."""
    models = [
        (each["model"], f"{each['scale']:.6f}", *_rms(each["residuals_m"].values()), len(each["residuals_m"]))
        for each in document["models"]
    ]
    return [
        f"Block of {pluralize(len(models), 'model')}: s0 {document['s0_m']:.4f} m, in plan "
        f"{document['s0_plan_m']:.4f}, "
        f"in height {document['s0_height_m']:.4f}, redundancy {document['redundancy']}",
        "",
        _table(("model", "scale", "rms vX, m", "vY", "vZ", "points"), models, 3),
        *_ground_tables(document),
        *_comparison_tables(document),
    ]


def warning_lines(document: Document) -> list[str]:
    """Return the warnings."""
    lines = [f"warning: {warning}" for warning in document.get("warnings", [])]
    return lines + [f"{name} is not written: {why}" for name, why in document.get("not_written", {}).items()]


def _join_tables(joins: Sequence[Document], differences: bool = False) -> Tables:
    rows = [
        (" - ".join(join["models"]), len(join["points"]), join["scale"], *join["rms_mm"], join["max_residual_mm"])
        for join in joins
    ]
    tables: Tables = [_table(("join", "points", "scale", "rms dX", "dY", "dZ", "largest"), rows)]
    if differences:
        closing = [
            (" - ".join(join["models"]), point, *each)
            for join in joins
            for point, each in join["differences_mm"].items()
        ]
        tables += ["", _table(("closing differences", "point", "dX", "dY", "dZ"), closing)]
    return tables


def _ground_tables(document: Document) -> Tables:
    residuals = document["residuals_m"]
    rows = [(point, each["role"], each["X"], each["Y"], each["Z"]) for point, each in residuals.items()]
    return [
        "",
        _table(("ground point", "role", "vX, m", "vY", "vZ"), rows, 3),
        *_accuracy_lines(document["accuracy_m"]),
    ]


def _accuracy_lines(accuracy: Document) -> list[str]:
    return [
        f"{points}, {pluralize(each['points'], 'point')}: rms X {_metres(each['rms']['X'])}, "
        f"Y {_metres(each['rms']['Y'])}, Z {_metres(each['rms']['Z'])} m; "
        f"plan {_metres(each['plan'])}, height {_metres(each['height'])} m"
        for points, each in accuracy.items()
    ]


def _polynomial_tables(document: Document) -> Tables:
    deformation = document["deformation"]
    return [
        f"Polynomials of degree {document['degree']}: "
        f"s0 in plan {document['s0_plan']:.4f} m, in height {document['s0_height']:.4f} m",
        f"the strip's bow: {deformation['horizontal_sag_m']:.3f} m in plan, "
        f"{deformation['vertical_sag_m']:.3f} m in height",
        f"its twist: {deformation['twist_gon_per_km']:.5f} gon/km, "
        f"scale drift {deformation['scale_drift_ppm_per_km']:.2f} ppm/km",
        *_ground_tables(document),
    ]


def _comparison_tables(document: Document) -> Tables:
    if "compare" not in document:
        return []
    comparison = document["compare"]
    rows: list[tuple[Any, ...]] = [(point, *each) for point, each in comparison["differences"].items()]
    rows += [(name, *comparison[key].values()) for name, key in (("mean square", "rms"), ("largest", "largest"))]
    return [
        "",
        f"Computed minus given, {pluralize(comparison['points'], 'point')}",
        _table(("point", "dX", "dY", "dZ"), rows, 3),
    ]


def _methods_table(rows: Sequence[Document]) -> Table:
    methods = list(rows[0]["values"])
    return _table(
        ("", *methods, "difference"),
        [
            (
                f"{row['quantity']}, {row['unit']}" if row["unit"] else row["quantity"],
                *(f"{row['values'][method]:.7f}" for method in methods),
                f"{row['difference']:.1e}",
            )
            for row in rows
        ],
    )


def _largest_difference_lines(comparison: Document) -> list[str]:
    each = (f"{value:.1e} {unit}".rstrip() for unit, value in comparison["largest_difference"].items())
    return [f"largest difference: {', '.join(each)}"]


def _rms(residuals: Iterable[Sequence[float]]) -> list[float]:
    columns = list(zip(*residuals, strict=True))
    return [float((sum(v * v for v in column) / len(column)) ** 0.5) for column in columns] or [0.0] * 3


def _metres(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def _table(header: Sequence[str], rows: Sequence[Sequence[Any]], decimals: int = 4) -> Table:
    """Return a table, its first column left-aligned, numbers right-aligned, a dash for unknown values."""
    table = text_table(*header, fold=(0,))
    for row in rows:
        table.add_row(*(_cell(value, decimals) for value in row))
    return table


def _cell(value: Any, decimals: int) -> str:
    if value is None or (isinstance(value, float) and isnan(value)):
        return "-"
    return f"{value:.{decimals}f}" if isinstance(value, float) else str(value)
