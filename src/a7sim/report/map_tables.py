"""Compiled model as tables for a terminal."""

from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from a7sim.session.compiling import USUAL_C_FACTORS
from a7sim.text import pluralize
from a7sim.text_tables import text_table


def map_tables(document: dict[str, Any]) -> RenderableType:
    """Return the lines of a compiled model compared with the truth, and the contour interval that they allow."""
    if document["message"]:
        return Text(f"{document['status']}: {document['message']}", style="bold")
    levelling, expected = document["levelling"], document["expected"]
    low, high = document["range_m"]
    parts: list[RenderableType] = [
        Text(
            f"Model {document['model']} levelled in {pluralize(levelling['rounds'], 'round')} to "
            f"1:{levelling['scale_found']:.1f}, {levelling['tilt_left_gon']:.3f} gon left; "
            f"drawn at 1:{document['map_scale']:.0f} by {document['plan_gear']}\n"
            f"{pluralize(document['spot_heights'], 'spot height')}, {low:.1f} to {high:.1f} m; "
            f"expected standard errors: height {expected['sigma_height_m']:.3f} m, "
            f"plan {expected['sigma_plan_m']:.3f} m"
        ),
        Text(),
        _lines(document["lines"]),
    ]
    contours = document["beside_the_truth"]["contours"]
    if contours is not None:
        parts += [Text(), Text(_in_words(contours))]
    operator = document["operator"]
    parts.append(
        Text(f"{operator['hours']:.1f} hours at the instrument, {pluralize(operator['lines_over_the_link'], 'line')}")
    )
    return Group(*parts)


def _lines(lines: list[dict[str, Any]]) -> Table:
    columns = ("line", "ends", "vertices", "m", "rms z, m", "largest", "rms off", "largest")
    table = text_table(*columns, left=(0, 1))
    for each in lines:
        off = (each.get("rms_off_m"), each.get("largest_off_m"))
        values = (each["rms_height_m"], each["largest_height_m"], *off)
        table.add_row(
            each["name"],
            "closed" if each["closed"] else " ".join(each["endings"]),
            str(each["vertices"]),
            f"{each['length_m']:.0f}",
            *("" if value is None else f"{value:.3f}" for value in values),
        )
    return table


def _in_words(contours: dict[str, Any]) -> str:
    low, high = USUAL_C_FACTORS
    factor = "without limit" if contours["c_factor"] is None else str(contours["c_factor"])
    return (
        f"Contours against the true ground: rms {contours['rms_height_m']:.3f} m, mean {contours['mean_m']:+.3f} m, "
        f"largest {contours['largest_m']:.3f} m, {contours['per_mille_of_flying_height']:.3f} per mille of the "
        f"flying height\nGood for an interval of {contours['smallest_interval_m']:.2f} m from "
        f"{contours['flying_height_m']:.0f} m above ground: C-factor {factor} "
        f"(plotters as a rule {low:.0f} to {high:.0f})"
    )
