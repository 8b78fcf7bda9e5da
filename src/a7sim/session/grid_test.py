"""Grid test of both projectors and its report with the true errors."""

from collections.abc import Iterator

import numpy as np
from rich.console import Group, RenderableType
from rich.rule import Rule
from rich.table import Table
from rich.text import Text

import a7sim
from a7sim.geometry import GON, angles_of
from a7sim.instrument import Autograph
from a7sim.instrument.condition import draw_condition
from a7sim.journal.session_files import RESIDUALS
from a7sim.journal.writer import make_header
from a7sim.operator.driving.controls import side_name, wrap_gon
from a7sim.operator.procedures.grid_test import GridTestPlan, ProjectorReadings, measure_grid
from a7sim.reduction import Adjustment
from a7sim.reduction.grid_test import UNKNOWNS
from a7sim.result_documents import Document, document_header, statistics_document
from a7sim.scenario import Condition, Scenario
from a7sim.session.lifecycle import RunOptions, recorded_session
from a7sim.session.results import end_document, request_document
from a7sim.table_files import to_csv
from a7sim.text import pluralize
from a7sim.text_tables import text_table

SYMBOLS = {"omega": "ω", "phi": "φ", "kappa": "κ"}

RESIDUAL_COLUMNS = ("projector", "level_mm", "cross", "x_mm", "y_mm", "vx_um", "vy_um")


def run_grid_test(
    scenario: Scenario,
    seed: int,
    plan: GridTestPlan,
    options: RunOptions | None = None,
) -> Document:
    """Test both projectors of a scenario's instrument and return the document; with `out`, write the files.

    `status` is 'complete', or 'does not fit' with the operator's `message`. Raises A7SimError for a plan that the plate
    or the instrument does not allow and for a folder that cannot be used, before anything is written.
    """
    options = options or RunOptions()
    recorded = recorded_session(scenario, seed, options)
    session = recorded.session
    autograph = session.autograph
    document = _document_header(scenario, seed, plan, autograph)
    options.prepare_folder()
    all_readings: list[ProjectorReadings] = []
    with recorded.recording(
        make_header("calibrate", scenario, seed, points=plan.crosses, levels=plan.levels, pointings=plan.pointings),
        lambda end: document | end_document(end),
        lambda: {RESIDUALS: to_csv(RESIDUAL_COLUMNS, _residual_rows(all_readings))},
        subject="test",
    ):
        for readings in measure_grid(session.person, plan, options.callbacks.on_point, options.callbacks.on_activity):
            all_readings.append(readings)
            truth = true_errors(autograph, draw_condition(scenario.instrument, seed), readings.projector)
            document["projectors"][side_name(readings.projector)] = projector_document(readings, truth)
    return document | end_document(recorded.end)


def _document_header(scenario: Scenario, seed: int, plan: GridTestPlan, autograph: Autograph) -> Document:
    return document_header("calibrate") | {
        **request_document(scenario),
        "software": f"a7sim {a7sim.__version__}",
        "scenario": scenario.title,
        "seed": seed,
        "variant": scenario.instrument.variant,
        "serial": scenario.instrument.serial,
        "plate": plan.plate.name,
        "crosses": len(plan.chosen),
        "levels_mm": plan.heights(autograph.variant),
        "pointings": plan.pointings,
        "status": "failed",
        "message": "",
        "projectors": {},
    }


# --- the document -------------------------------------------------------------------------------------


def projector_document(readings: ProjectorReadings, truth: Document) -> Document:
    """Return the results of a projector, um at photo scale, with the true errors and the differences."""
    test = readings.test
    found = _element_documents(readings)
    residuals = 1e3 * test.residuals[..., 0]
    names = list(readings.crosses)
    max_index = np.unravel_index(int(np.hypot(*residuals).argmax()), residuals.shape[1:])
    observations = [f"{axis} {cross} at {z:g}" for axis in "XY" for z in readings.heights for cross in names]
    return {
        "elements": found,
        "held": [name for name in UNKNOWNS if name not in test.errors],
        "s0_um": round(1e3 * float(test.s0[0]), 3),
        "pointing_um": _finite(1e3 * float(readings.pointing[0])),
        "largest_residual": {
            "cross": names[max_index[1]],
            "level_mm": readings.heights[max_index[0]],
            "um": round(float(np.hypot(*residuals)[max_index]), 3),
        },
        "residuals_um": {
            cross: [round(float(v), 3) for v in residuals.mean(axis=1)[:, i]] for i, cross in enumerate(names)
        },
        "statistics": statistics_document(_single_adjustment(readings), list(test.errors), observations),
        "finished_at_s": round(float(readings.finished_at[0]), 1),
        "truth": truth
        | {"differences": {name: round(found[name]["error"] - truth["errors"][name], 5) for name in test.errors}},
    }


def _single_adjustment(readings: ProjectorReadings) -> Adjustment:
    """Return the adjustment without its batch axis."""
    batch = readings.test.adjustment
    unknowns, cofactors, residuals, s0, condition, design = (
        each[..., 0]
        for each in (batch.unknowns, batch.cofactors, batch.residuals, batch.s0, batch.condition, batch.design)
    )
    return Adjustment(unknowns, cofactors, residuals, batch.redundancy, s0, condition, design)


def _element_documents(readings: ProjectorReadings) -> Document:
    elements = {}
    for name, error in readings.test.errors.items():
        unit = "gon" if name in SYMBOLS else "mm"
        scale = GON if unit == "gon" else 1.0
        off = float(error[0]) / scale
        sigma = float(readings.test.sigmas[name][0]) / scale
        entry: Document = {"error": round(off, 5), "sigma": round(sigma, 5), "unit": unit}
        counter = readings.counters.get("bx" if name == "bx" else f"{name}{readings.projector}")
        if counter is not None:
            entry = {"counter": float(counter[0]), "found": round(float(counter[0]) + off, 5)} | entry
        elements[name] = entry
    return elements


def _finite(value: float) -> float | None:
    return round(value, 3) if np.isfinite(value) else None


def _residual_rows(all_readings: list[ProjectorReadings]) -> Iterator[tuple[str, ...]]:
    for each in all_readings:
        residuals = 1e3 * each.test.residuals[..., 0]
        for k, height in enumerate(each.heights):
            for i, (cross, place) in enumerate(each.crosses.items()):
                yield (
                    side_name(each.projector),
                    f"{height:.2f}",
                    cross,
                    *(f"{at:.1f}" for at in place),
                    *(f"{v:.2f}" for v in residuals[:, k, i]),
                )


# --- the truth ----------------------------------------------------------------------------------------


def true_errors(autograph: Autograph, condition: Condition, projector: int) -> Document:
    """Return the errors of a projector that a grid test should find, mm and gon, and the part caused by the carriages.

    Scales and skews of the carriages look like errors of the projector: X = (1 + sx) Xr + xy Yr + xz Zr and so on
    change c by c ((sx + sy)/2 - sz), the principal point by -c (xz, yz), kappa by xy / 2.
    """
    centre, rotation = autograph.pose(projector)
    omega, phi, kappa = (float(angle) / GON for angle in angles_of(rotation))
    elements = autograph.variant.elements
    projector_condition = condition.left if projector == 1 else condition.right
    counter_names = {name: f"{name}{projector}" for name in ("c", "omega", "phi", "kappa", "by", "bz")}
    counters = {name: autograph.element(n) if n in elements else 0.0 for name, n in counter_names.items()}
    base = autograph.element("bx") if projector == 2 else 0.0
    sx, sy, sz = (1e-6 * ppm for ppm in condition.carriage_scale_ppm)
    xy, xz, yz = (1e-6 * ppm for ppm in condition.carriage_skew_ppm)
    carriage_errors = {
        "c": counters["c"] * ((sx + sy) / 2.0 - sz),
        "x0": -counters["c"] * xz,
        "y0": -counters["c"] * yz,
        "kappa": xy / 2.0 / GON,
    }
    element_errors = {
        "c": projector_condition.principal_distance_mm,
        "x0": 1e-3 * projector_condition.principal_point_um[0],
        "y0": 1e-3 * projector_condition.principal_point_um[1],
        "omega": omega + elements[f"omega{projector}"].zero - counters["omega"],
        "phi": phi + elements[f"phi{projector}"].zero - counters["phi"],
        "kappa": float(wrap_gon(np.asarray(kappa - counters["kappa"]))),
        "bx": float(centre[0]) - base,
        "by": -float(centre[1]) - counters["by"],
        "bz": float(centre[2]) - counters["bz"],
    }
    return {
        "errors": {name: round(error + carriage_errors.get(name, 0.0), 5) for name, error in element_errors.items()},
        "of_the_carriages": {name: round(error, 5) for name, error in carriage_errors.items() if error},
    }


# --- the sheet ----------------------------------------------------------------------------------------


def report_tables(document: Document) -> RenderableType:
    """Return the report of the grid test as tables."""
    parts: list[RenderableType] = [
        Text(f"Grid test of Wild {document['variant']} no. {document['serial']}", style="bold"),
        Text(
            f"{pluralize(document['crosses'], 'cross', 'crosses')} of plate {document['plate']} at Z "
            f"{' and '.join(f'{-z:g}' for z in document['levels_mm'])} mm below the centre, "
            f"{pluralize(document['pointings'], 'pointing')} each"
        ),
    ]
    for projector, each in document["projectors"].items():
        parts += [Rule(Text(f"{projector} projector"), align="left"), _element_table(each), *_remarks(each)]
    if document["message"]:
        parts.append(Text(f"{document['status']}: {document['message']}", style="bold"))
    return Group(*parts)


def _element_table(projector: Document) -> Table:
    table = text_table("", "counter", "found", "error", "±", "true", "", left=(0, 6))
    for name, each in projector["elements"].items():
        counter = f"{each['counter']:.2f}" if "counter" in each else ""
        found = f"{each['found']:.4f}" if "found" in each else ""
        true = f"{projector['truth']['errors'][name]:+.4f}"
        table.add_row(
            SYMBOLS.get(name, name), counter, found, f"{each['error']:+.4f}", f"{each['sigma']:.4f}", true, each["unit"]
        )
    return table


def _remarks(projector: Document) -> Iterator[Text]:
    largest = projector["largest_residual"]
    pointing = projector["pointing_um"]
    yield Text(
        f"s0 {projector['s0_um']:.1f} µm at photo scale"
        + (f", a pointing repeats to {pointing:.1f} µm" if pointing is not None else "")
        + f"; largest residual {largest['um']:.1f} µm at {largest['cross']}, Z {-largest['level_mm']:g} mm"
    )
    if projector["held"]:
        yield Text(f"held, because one level does not separate them from c, x0 and y0: {', '.join(projector['held'])}")
    if projector["truth"]["of_the_carriages"]:
        yield Text("true errors are as the carriages show them; their own scales and skews are in c, x0, y0 and κ")
