"""Results in the form of the thesis, compared with the truth, for a terminal."""

from collections.abc import Iterator
from typing import Any

from rich.console import Group, RenderableType
from rich.rule import Rule
from rich.table import Table
from rich.text import Text

from a7sim.standard_points import FIGURE_4_1, POSITIONS
from a7sim.text import pluralize
from a7sim.text_tables import text_table

_ELEMENTS = (
    ("κ", "kappa", "gon"),
    ("φ", "phi", "gon"),
    ("ω", "omega", "gon"),
    ("by", "by", "mm"),
    ("bz", "bz", "mm"),
    ("c", "c", "mm"),
)


def session_tables(document: dict[str, Any]) -> RenderableType:
    """Return the tables of a session."""
    parts: list[RenderableType] = []
    for model in document.get("models", ()):
        parts.extend(model_tables(model))
    if "strip" in document:
        parts += [Rule(Text("Strip"), align="left"), *strip_tables(document["strip"]), Text()]
    for name, strip in document.get("ways", {}).items():
        parts += [Rule(Text(f"Strip, {name}"), align="left"), *strip_tables(strip), Text()]
    if "a8_minus_comparator_m" in document:
        each = document["a8_minus_comparator_m"]
        parts += [_titled("A8 minus comparator", accuracy_table({"points": each})), Text()]
    if "operator" in document:
        parts.append(hours_table(document["operator"]))
    if document["message"]:
        parts.append(Text(f"{document['status']}: {document['message']}", style="bold"))
    return Group(*parts)


def hours_table(operator: dict[str, Any]) -> Text:
    """Return the time spent by an operator; for a session of a batch, without lines and book."""
    activities = (f"{name} {hours:.1f}" for name, hours in operator["time_by_activity_h"].items())
    described = [f"{operator['hours']:.1f} hours at the instrument"]
    if "book_entries" in operator:
        described += [
            pluralize(operator["lines_over_the_link"], "line") + " over the link",
            pluralize(operator["book_entries"], "reading") + " in the book",
            f"{operator['struck_out']} struck out",
        ]
    return Text(f"{', '.join(described)}\nWhere they went: {', '.join(activities)}")


def strips_table(document: dict[str, Any]) -> RenderableType:
    """Return the table of the strips of all cases, with the diagram of the first as text."""
    table = text_table("strip", "cases", "join, mm", "control plan", "height", "checks plan", "height")
    for strip in document["strips"]:
        accuracy = strip["accuracy_m"]
        cells = [f"{accuracy[on][what]:.3f}" if on in accuracy else "" for on in ON for what in WHAT]
        table.add_row(str(strip["number"]), " ".join(strip["cases"]), f"{_worst_join(strip):.3f}", *cells)
    hours = sum(session["hours"] for session in document["sessions"].values())
    described_as = f"{document['status']}: {document['message']}" if document["message"] else ""
    first = document["strips"][0]["in_words"] if document["strips"] else ""
    return Group(
        _titled("Strips of all cases, rms residuals in m", table),
        Text(f"\n{first}", overflow="fold"),
        Text(f"{hours:.1f} hours at the instrument in {pluralize(len(document['sessions']), 'session')}"),
        *([Text(described_as, style="bold")] if described_as else []),
    )


ON, WHAT = ("control", "checks"), ("plan", "height")


def _worst_join(strip: dict[str, Any]) -> float:
    return max((join["max_residual_mm"] for join in strip["joins"]), default=0.0)


def strip_tables(strip: dict[str, Any]) -> Iterator[RenderableType]:
    """Yield joins, residuals and accuracy of a strip, or the reason why it is not on the ground."""
    if "message" in strip:
        yield Text(f"No strip on the ground: {strip['message']}")
        return
    for join in strip["joins"]:
        yield Text(
            f"Models {' and '.join(join['models'])} joined, scale {join['scale']:.5f}, "
            f"closing within {join['max_residual_mm']:.3f} mm"
        )
    yield Text(f"On the ground at 1:{1e3 * strip['absolute']['scale']:.0f}")
    residuals = text_table("point", "role", "X", "Y", "Z")
    last = strip.get("polynomial", strip)
    for point, each in last["residuals_m"].items():
        residuals.add_row(point, each["role"], *("" if each[axis] is None else f"{each[axis]:+.3f}" for axis in "XYZ"))
    yield _titled("Residuals, computed minus given, m", residuals)
    yield _titled("Accuracy", accuracy_table(strip["accuracy_m"]))
    if "polynomial" in strip:
        adjusted = strip["polynomial"]
        yield _titled(f"After the polynomial of degree {adjusted['degree']}", accuracy_table(adjusted["accuracy_m"]))
        found = adjusted["deformation"]
        yield Text(
            f"The strip was bent by {found['vertical_sag_m']:+.2f} m in height and by "
            f"{found['horizontal_sag_m']:+.2f} m in plan, twisted by {found['twist_gon_per_km']:+.4f} gon/km, and its "
            f"scale drifted by {found['scale_drift_ppm_per_km']:+.1f} ppm/km"
        )
    yield from (Text(f"warning: {warning}") for warning in strip["warnings"])


def accuracy_table(sets: dict[str, Any]) -> Table:
    """Return rms and largest residuals of sets of points."""
    accuracy = text_table("rms, m", "X", "Y", "Z", "plan", "height", "largest X", "Y", "Z")
    for on, each in sets.items():
        values = [*each["rms"].values(), each["plan"], each["height"], *each["largest"].values()]
        accuracy.add_row(f"{each['points']} {on}", *("" if value is None else f"{value:.3f}" for value in values))
    return accuracy


def model_tables(model: dict[str, Any]) -> Iterator[RenderableType]:
    """Yield the tables of a model."""
    orientation = model["relative_orientation"]
    title = f"Model {model['model']}: {model['left']} and {model['right']}, base {model['base']}"
    yield Rule(Text(title), align="left")
    yield rounds_table(orientation)
    yield elements_table(orientation["elements"], model["truth"].get("elements", {}))
    yield _residuals(orientation)
    yield centres_table(model)
    if "absolute_orientation" in model:
        yield ground_table(model["absolute_orientation"])
    yield truth_table(model["truth"])
    yield Text()


def _titled(title: str, table: Table) -> RenderableType:
    return Group(Text(), Text(title, style="bold"), table)


def rounds_table(orientation: dict[str, Any]) -> RenderableType:
    """Return the iterations of a relative orientation."""
    if orientation["procedure"] == "empirical":
        return _cleared_rounds(orientation)
    table = text_table("iteration", "mean p, mm", "rms, mm")
    for number, each in enumerate(orientation["rounds"], start=1):
        table.add_row(str(number), f"{each['mean_mm']:.4f}", f"{each['rms_mm']:.4f}")
    title = f"Numerical relative orientation, {orientation['method']}, case {orientation['case']}"
    return _titled(title, table)


def _cleared_rounds(orientation: dict[str, Any]) -> RenderableType:
    """Return the parallaxes at the points before omega was turned, round by round, and the over-correction."""
    labels = [label for label in POSITIONS if any(label in each["parallax_mm"] for each in orientation["rounds"])]
    table = text_table("iteration", *labels, "rms, mm", "n")
    for number, each in enumerate(orientation["rounds"], start=1):
        seen = [f"{each['parallax_mm'][label]:+.3f}" if label in each["parallax_mm"] else "" for label in labels]
        n = each["over_correction"]
        table.add_row(str(number), *seen, f"{each['rms_mm']:.4f}", f"{n:.2f}" if n else "")
    method = "one projector" if orientation["method"] == "dependent" else "swing-swing"
    return _titled(
        f"Empirical relative orientation, {method}: y-parallaxes in mm before omega is turned n times", table
    )


def elements_table(elements: dict[str, float], true: dict[str, float]) -> RenderableType:
    """Return the elements as counters show them, with the true ones."""
    table = text_table("", "left '", "true", 'right "', "true", "")

    def cells(name: str) -> list[str]:
        return [f"{elements[name]:.2f}", f"{true[name]:.3f}" if name in true else ""]

    for symbol, name, unit in _ELEMENTS:
        if f"{name}1" not in elements:
            continue
        table.add_row(symbol, *cells(f"{name}1"), *cells(f"{name}2"), unit)
    table.add_row("bx", *cells("bx"), "", "", "mm")
    return _titled("Elements as set", table)


def _residuals(orientation: dict[str, Any]) -> RenderableType:
    residuals = orientation["residual_parallax_mm"]
    rms = orientation["rms_parallax_mm"]
    table = text_table(*[""] * 5)
    table.show_header = False
    shown = [column for column in zip(*FIGURE_4_1, strict=True) if any(label in residuals for label in column)]
    for row in zip(*shown, strict=True):
        table.add_row(*(f"{label} {residuals[label]:+.3f}" if label in residuals else "" for label in row))
    return _titled(f"Residual y-parallaxes at the standard points, mm (rms {rms:.4f})", table)


def centres_table(model: dict[str, Any]) -> RenderableType:
    """Return both perspective centres with their standard deviations and true values."""
    table = text_table("", "left", "±", "true", "right", "±", "true")
    sides = ("left", "right")
    centres, truth = model["perspective_centres"], model["truth"]["centres"]
    for name in ("X0", "Y0", "Z0", "T0"):
        cells = []
        for side in sides:
            cells += [f"{centres[side][name]:.3f}", f"{centres[side][f'sigma_{name}']:.3f}"]
            cells.append(f"{truth[side][name]:.3f}" if name in truth[side] else "")
        table.add_row(name, *cells)
    table.add_row("rms", *(cell for side in sides for cell in (f"{centres[side]['rms']:.3f}", "", "")))
    return _titled("Perspective centres, counter units", table)


def ground_table(found: dict[str, Any]) -> RenderableType:
    """Return the levelling and scaling of a model at the instrument."""
    table = text_table("round", "heights, rms m", "scale", "along, gon", "across, gon")
    for number, each in enumerate(found["rounds"], start=1):
        tilts = (f"{tilt:+.3f}" for tilt in each["tilts_gon"])
        table.add_row(str(number), f"{each['height_rms_m']:.3f}", f"{each['scale']:.5f}", *tilts)
    heights = "  ".join(f"{point} {off:+.3f}" for point, off in found["heights_m"].items())
    changed = (
        f"{name} {value:.2f} (before {found['elements_before'][name]:.2f})"
        for name, value in found["elements"].items()
        if value != found["elements_before"][name]
    )
    agree = "agree" if found["agrees"] else "do not agree"
    return Group(
        _titled(f"Absolute orientation at 1:{found['scale_number']:.0f}, gear {found['height_gear']}", table),
        Text(f"Heights at control, m: {heights}; they {agree} within {found['tolerated_m']:.2f} m"),
        Text(f"Distance between control, m: {found['distance_m']:+.3f}"),
        Text(f"Set meanwhile: {', '.join(changed)}"),
    )


def truth_table(truth: dict[str, Any]) -> Text:
    """Return the differences of the relative orientation from the truth."""
    if "source" not in truth:
        return Text("\nNo true relative orientation is known.")
    return Text(
        f"\nAgainst {truth['source']}: relative rotation off by {truth['rotation_difference_gon']:.4f} gon, "
        f"base direction by {truth['base_difference_gon']:.4f} gon" + _beside_sigmas(truth)
    )


def _beside_sigmas(truth: dict[str, Any]) -> str:
    if "published_sigmas" not in truth:
        return ""
    sigmas = truth["published_sigmas"]
    angles = ", ".join(f"{name} {sigmas[f'sigma_{name}']:.4f}" for name in ("omega", "phi", "kappa"))
    return f" (its own standard deviations: {angles} gon, by {sigmas['sigma_by']:.4f}, bz {sigmas['sigma_bz']:.4f} mm)"
