"""Results of a session as one document and as model files."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import msgspec

import a7sim
from a7sim.geometry import Array
from a7sim.operator import ModelRecord, Person
from a7sim.operator.people.timesheet import Timesheet
from a7sim.operator.procedures.absolute import GroundOrientation
from a7sim.reduction import Model, PerspectiveCentre
from a7sim.result_documents import Document, differences_document, document_header
from a7sim.scenario import Scenario, ScenarioWithProvenance
from a7sim.scenario.schema import Published
from a7sim.session.result_records import CENTRE_DECIMALS, POINT_DECIMALS, ModelResult, SessionEnd, SessionResult
from a7sim.strip_methods.a8_vs_comparator import coordinate_differences
from a7sim.strip_methods.strip import oriented_strip_document
from a7sim.table_files import to_csv

SIDES = {1: "left", 2: "right"}

_CENTRE_FIELDS = ("X0", "Y0", "Z0", "T0", "sigma_X0", "sigma_Y0", "sigma_Z0", "sigma_T0", "rms")


def results_header(scenario: Scenario, seed: int) -> dict[str, Any]:
    """Return the first keys of a document of results."""
    plan = scenario.plotting
    return (
        document_header("run")
        | {
            "software": f"a7sim {a7sim.__version__}",
            "scenario": scenario.title,
            "seed": seed,
            "variant": scenario.instrument.variant,
            "work": scenario.work,
        }
        | ({"method": plan.method, "case": plan.case} if plan else {})
        | request_document(scenario)
    )


def request_document(scenario: Scenario) -> dict[str, Any]:
    """Return the command that repeats a session, and its changes to the scenario file."""
    return msgspec.structs.asdict(scenario.request) if isinstance(scenario, ScenarioWithProvenance) else {}


def session_document(result: SessionResult, brief: bool = False) -> Document:
    """Return the document of a session's results.

    If `brief`, the models contain only the values of the strip and of the named responses of a study.
    """
    document = results_header(result.scenario, result.seed) | {"status": result.status, "message": result.message}
    if result.models is not None:
        document["models"] = [brief_model_document(each) if brief else model_document(each) for each in result.models]
    if result.operator is not None:
        document["operator"] = result.operator
    if result.slips is not None:
        document["truth"] = {"slips": result.slips}
    if result.strip is not None:
        document["strip"] = oriented_strip_document(result.strip.strip)
    elif result.strip_message:
        document["strip"] = {"message": result.strip_message}
    methods = result.methods
    if methods:
        document["ways"] = {name: oriented_strip_document(each.strip) for name, each in methods.items()}
    if result.bridging is not None:
        document.setdefault("operator", result.bridging.operator)
    if "comparator" in methods and "A8" in methods:
        differences = coordinate_differences(methods["comparator"], methods["A8"])
        document["a8_minus_comparator_m"] = differences_document(differences)
    return document


def end_document(end: SessionEnd) -> Document:
    """Return the end of a session for its document: status, operator and slips."""
    return {
        "status": end.status,
        "message": end.message,
        "operator": end.operator,
        "truth": {"slips": end.slips},
    }


def model_document(result: ModelResult) -> Document:
    """Return the results of a model with the truth."""
    record = result.record
    orientation = record.orientation
    model = record.model
    measured_centres = {side: _centre_document(centre) for side, centre in record.centres.items()}
    return {
        **_model_heading(record),
        "interior_orientation": [
            {
                "photo": each.photograph,
                "rounds": each.rounds,
                "residual_mm": round(each.residual_mm, 4),
                "film_scale_ppm": round(1e6 * each.film_scale, 1),
                "principal_distance": each.principal_distance,
            }
            for each in record.interior.values()
        ],
        "relative_orientation": {
            "procedure": orientation.procedure,
            "method": orientation.method,
            "case": orientation.case,
            "iterations": len(orientation.rounds),
            "rough_iterations": orientation.rough_rounds,
            "rounds": [
                {
                    "rms_mm": round(each.rms, 6),
                    "mean_mm": round(each.mean, 6),
                    "parallax_mm": _rounded(each.parallaxes),
                    "sigmas": _rounded(each.sigmas),
                }
                | ({"over_correction": round(each.over_correction, 3)} if orientation.procedure == "empirical" else {})
                for each in orientation.rounds
            ],
            "rms_parallax_mm": round(orientation.rms, 6),
            "residual_parallax_mm": _rounded(orientation.residuals),
            "elements": dict(orientation.elements),
        },
        "perspective_centres": {SIDES[side]: centre for side, centre in measured_centres.items()},
        "points": _points_document(record),
        "standard_points": dict(model.standard_points),
        **({"absolute_orientation": _ground_document(record.on_ground)} if record.on_ground else {}),
        "truth": _truth_document(result, measured_centres) | _published_sigmas(result.published),
    }


def brief_model_document(result: ModelResult) -> Document:
    """Return the results of a model needed by its strip and by the named responses of a study."""
    record = result.record
    orientation = record.orientation
    measured_centres = {side: _centre_document(centre, _CENTRE_FIELDS[:3]) for side, centre in record.centres.items()}
    return {
        **_model_heading(record),
        "relative_orientation": {
            "iterations": len(orientation.rounds),
            "rms_parallax_mm": round(orientation.rms, 6),
        },
        "perspective_centres": {SIDES[side]: centre for side, centre in measured_centres.items()},
        "points": _points_document(record),
        "truth": _truth_differences(result, measured_centres),
    }


def _model_heading(record: ModelRecord) -> dict[str, Any]:
    model = record.model
    return {
        "model": model.name,
        "left": model.left,
        "right": model.right,
        "base": model.base,
        "xy_units_per_mm": record.xy_units_per_mm,
        "z_units_per_mm": record.z_units_per_mm,
        "finished_at_s": round(record.finished_at, 1),
    }


def _points_document(record: ModelRecord) -> dict[str, dict[str, float]]:
    return {
        point: {axis: round(value, POINT_DECIMALS) for axis, value in zip("XYZ", coordinates, strict=True)}
        for point, coordinates in record.points.items()
    }


def operator_document(person: Person, lines: int) -> dict[str, Any]:
    """Return the entries of an operator and the time spent, hours."""
    book = person.book
    return hours_document(person.clock.now, person.timesheet) | {
        "lines_over_the_link": lines,
        "book_entries": len(book.entries),
        "struck_out": sum(bool(entry.struck) for entry in book.entries),
        "remarks": book.remarks,
    }


def hours_document(seconds: float, timesheet: Timesheet, session: int = 0) -> dict[str, Any]:
    """Return the duration of a session and the time spent, hours."""
    return {
        "hours": round(seconds / 3600.0, 3),
        "time_by_activity_h": _hours(timesheet.activities_of(session)),
        "time_by_act_h": _hours(timesheet.acts_of(session)),
    }


def slips_document(person: Person) -> list[dict[str, Any]]:
    """Return the slips of an operator with the right values."""
    struck = {entry.number for entry in person.book.entries if entry.struck}
    return [
        {
            "time_s": round(slip.time, 1),
            "model": slip.model,
            "form": slip.form,
            "round": slip.round,
            "point": slip.point,
            "item": slip.item,
            "kind": slip.kind,
            "written": slip.written,
            "right": slip.right,
            "entry": slip.entry or None,
            "struck": slip.entry in struck,
        }
        for slip in person.slips
    ]


def _hours(seconds: Mapping[str, float]) -> dict[str, float]:
    return {name: round(each / 3600.0, 4) for name, each in seconds.items()}


def _ground_document(orientation: GroundOrientation) -> dict[str, Any]:
    return {
        "scale_number": orientation.scale_number,
        "height_gear": orientation.height_gear,
        "rounds": [
            {
                "height_rms_m": round(each.height_rms, 4),
                "scale": round(each.scale, 6),
                "tilts_gon": [round(tilt, 4) for tilt in each.tilts],
            }
            for each in orientation.rounds
        ],
        "elements": dict(orientation.elements),
        "elements_before": dict(orientation.before),
        "heights_m": {point: round(off, 3) for point, off in orientation.heights.items()},
        "distance_m": round(orientation.distance, 3),
        "tolerated_m": round(orientation.tolerated, 3),
        "agrees": orientation.within_tolerance,
        "points": {
            point: {axis: round(value, 3) for axis, value in zip("XYZ", place, strict=True)}
            for point, place in orientation.points.items()
        },
    }


def _centre_document(centre: PerspectiveCentre, fields: Sequence[str] = _CENTRE_FIELDS) -> dict[str, float]:
    return {name: round(float(getattr(centre, name)), CENTRE_DECIMALS) for name in fields}


def _rounded(values: Any) -> dict[str, float]:
    return {name: round(value, 6) for name, value in values.items()}


def _truth_document(result: ModelResult, measured_centres: dict[int, dict[str, float]]) -> dict[str, Any]:
    comparison, member = result.comparison, result.member
    centres = {
        SIDES[side]: {name: round(float(each[member]), 5) for name, each in comparison.centres[side].items()}
        for side in measured_centres
    }
    differences = _truth_differences(result, measured_centres)
    relative = comparison.relative
    if relative is None:
        return {"centres": centres, **differences}
    true_elements = {name: float(each[member]) for name, each in relative.elements.items()}
    elements = result.record.orientation.elements
    return {
        "centres": centres,
        "centre_differences": differences.pop("centre_differences"),
        "source": relative.source,
        "relative_rotation": _matrix(relative.true.rotation),
        "base_direction": _vector(relative.true.base),
        "found_relative_rotation": _matrix(relative.found.rotation[..., member]),
        "found_base_direction": _vector(relative.found.base[..., member]),
        **differences,
        "elements": _rounded(true_elements),
        "element_differences": {
            name: round((elements[name] - value + 200.0) % 400.0 - 200.0, 6) for name, value in true_elements.items()
        },
    }


def _truth_differences(result: ModelResult, measured_centres: dict[int, dict[str, float]]) -> dict[str, Any]:
    """Return the differences of the results from the truth as single numbers."""
    comparison, member = result.comparison, result.member
    document: dict[str, Any] = {
        "centre_differences": {
            SIDES[side]: {
                name: round(centre[name] - float(each[member]), 5) for name, each in comparison.centres[side].items()
            }
            for side, centre in measured_centres.items()
        }
    }
    if comparison.relative is None:
        return document
    return document | {
        "rotation_difference_gon": round(float(comparison.relative.rotation_gon[member]), 5),
        "base_difference_gon": round(float(comparison.relative.base_gon[member]), 5),
    }


def _published_sigmas(published: Published | None) -> dict[str, Any]:
    if published is None:
        return {}
    names = ("sigma_omega", "sigma_phi", "sigma_kappa", "sigma_by", "sigma_bz")
    return {"published_sigmas": {name: getattr(published, name) for name in names}}


def _vector(values: Array) -> list[float]:
    return [round(value, 9) for value in values.tolist()]


def _matrix(values: Array) -> list[list[float]]:
    return [_vector(row) for row in values]


def models_csv(models: Sequence[Model]) -> str:
    """Return model coordinates and centres in mm, Z upward."""
    rows = ((model.name, name, *_mm(*at)) for model in models for name, at in _named_points(model))
    return "# mm at model scale, Z up\n" + to_csv(("model", "point", "X", "Y", "Z"), rows)


def points_csv(model: Model) -> str:
    """Return the points of a strip in the system of the ground, m."""
    return to_csv(("point", "X", "Y", "Z"), ((name, *_mm(*at)) for name, at in _named_points(model)))


def _named_points(model: Model) -> Iterator[tuple[str, list[float]]]:
    return zip(model.points, model.coordinates.T.tolist(), strict=True)


def strips_csv(strips: Sequence[Document]) -> str:
    """Return the accuracies of all strips in m, one per line."""
    header = (
        "strip",
        "cases",
        "scale",
        "max_join_mm",
        *(f"{group}_{direction}_m" for group in POINT_GROUPS for direction in DIRECTIONS),
    )
    return to_csv(header, (_strip_row(strip) for strip in strips))


def _strip_row(strip: Document) -> tuple[str, ...]:
    accuracy = strip["accuracy_m"]
    max_residual_mm = max((join["max_residual_mm"] for join in strip["joins"]), default=0.0)
    cells = [
        accuracy[group][direction] if group in accuracy else math.nan
        for group in POINT_GROUPS
        for direction in DIRECTIONS
    ]
    return (
        str(strip["number"]),
        "".join(strip["cases"]),
        f"{strip['absolute']['scale']:.7f}",
        *_mm(max_residual_mm, *cells),
    )


POINT_GROUPS, DIRECTIONS = ("control", "checks"), ("plan", "height")


def _mm(*values: float) -> tuple[str, ...]:
    return tuple(f"{value:.4f}" for value in values)
