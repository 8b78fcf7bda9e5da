"""Compilation of a model: the operator draws contours and lines, and the session compares them with the true ground."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import msgspec
import numpy as np

import a7sim
from a7sim.errors import A7SimError
from a7sim.geometry import Array, length_of
from a7sim.journal.session_files import GEOJSON, SVG
from a7sim.journal.writer import make_header
from a7sim.operator.mapping.map_lines import CONTOUR, LineTarget, TracedLine, Tracing
from a7sim.operator.mapping.plotting import TABLE_GEARS, CompiledMap, MapRequest, compile_map
from a7sim.plotters import BASE_COMPONENTS, VARIANTS
from a7sim.result_documents import Document, absolute_document, document_header
from a7sim.scenario import Scenario
from a7sim.scene import Scene
from a7sim.session.lifecycle import ProgressCallbacks, RunOptions, Session, recorded_session
from a7sim.session.map_svg import to_geojson, to_svg
from a7sim.session.results import end_document, request_document
from a7sim.strip_methods.strip import given_control

OLD_MAP_M = 5.0
"""Rounding in m of the line data that an operator gets from an old map."""

_DIRECTION_DISTANCE_M = 40.0

HALF_INTERVAL_FACTOR = 3.29
"""A contour interval fits a standard error if 90 % of the heights are within half of it: 2 x 1.645 standard errors."""

USUAL_C_FACTORS = (900.0, 2200.0)
"""From conventional plotters to analytical ones; general knowledge of the trade, no source at hand."""


@dataclass(frozen=True)
class CompilationRequest:
    """Requested compilation."""

    model: str
    contours: tuple[float, ...] = ()
    interval: float | None = None
    lines: tuple[str, ...] = ()
    map_scale: float | None = None
    tremor_um: float | None = None

    @classmethod
    def from_settings(cls, settings: Mapping[str, Any]) -> "CompilationRequest":
        """Return the request in the settings of a journal."""
        return msgspec.convert(dict(settings), cls)


def compile_model(
    scenario: Scenario,
    seed: int,
    request: CompilationRequest,
    options: RunOptions | None = None,
) -> Document:
    """Compile a model with the virtual operator and return the document of results; with `out`, write map and files.

    `status` is 'complete', or 'does not fit' with the operator's `message`. Raises A7SimError for an impossible
    request.
    """
    options = options or RunOptions()
    _check_request(scenario, request)
    recorded = recorded_session(scenario, seed, options)
    session = recorded.session
    map_request = _map_request(request, scenario, session.scene)
    options.prepare_folder()
    document = document_header("compile") | {
        **request_document(scenario),
        "software": f"a7sim {a7sim.__version__}",
        "scenario": scenario.title,
        "seed": seed,
        "model": request.model,
        "status": "failed",
        "message": "",
    }
    drawings: dict[str, str] = {}
    header = make_header("compile", scenario, seed, **asdict(request))
    with recorded.recording(header, lambda end: document | end_document(end), lambda: drawings):
        compiled = _compile(session, request, map_request, options.callbacks)
        document |= _map_document(compiled, session.scene, scenario)
        drawings |= {GEOJSON: to_geojson(compiled), SVG: to_svg(compiled, scenario.title)}
    return document | end_document(recorded.end)


def _check_request(scenario: Scenario, request: CompilationRequest) -> None:
    if VARIANTS[scenario.instrument.variant].missing_elements(*BASE_COMPONENTS):
        raise A7SimError(
            "instrument.variant: expected a plotter with by and bz, whose cameras the stereo view knows, "
            f"got an {scenario.instrument.variant}"
        )
    if scenario.plan.plan_gear not in TABLE_GEARS:
        known = ", ".join(TABLE_GEARS)
        raise A7SimError(
            f"plan.plan_gear: expected a gear to the plotting table ({known}), got {scenario.plan.plan_gear}"
        )
    models = {model.name: model for model in scenario.models}
    if request.model not in models:
        raise A7SimError(f"--model: expected one of {', '.join(models)}, got {request.model}")
    flown = {photo.name for photo in scenario.photos if photo.position is not None}
    model = models[request.model]
    if not {model.left, model.right} <= flown:
        raise A7SimError(
            f"--model {request.model}: expected photographs that show the ground, got measured points only"
        )
    known_lines = [line.name for line in scenario.lines]
    for name in request.lines:
        if name not in known_lines:
            raise A7SimError(
                f"--line: expected one of {', '.join(known_lines) or 'none, the scenario has no lines'}, got {name}"
            )
    if not (request.contours or request.interval or request.lines):
        raise A7SimError("compile: expected a --contour, an --interval or a --line to be drawn, got none")


def _map_request(request: CompilationRequest, scenario: Scenario, scene: Scene) -> MapRequest:
    targets = tuple(_line_target(scene, name) for name in dict.fromkeys(request.lines))
    tracing = Tracing.of(scenario.observer, request.tremor_um)
    return MapRequest(request.contours, request.interval, targets, tracing, request.map_scale)


def _line_target(scene: Scene, name: str) -> LineTarget:
    """Return the data of a line on an old map: its two ends and its initial direction, rounded to some metres."""
    line = scene.lines[name]
    along = np.concatenate([[0.0], np.cumsum(length_of(np.diff(line.middle, axis=1)))])
    direction_point = line.middle[:, int(np.searchsorted(along, min(_DIRECTION_DISTANCE_M, along[-1])))]

    def map_position(place: Array) -> tuple[float, float]:
        east, north = OLD_MAP_M * np.round(place / OLD_MAP_M)
        return float(east), float(north)

    return LineTarget(
        name,
        line.kind,
        map_position(line.middle[:, 0]),
        map_position(direction_point),
        map_position(line.middle[:, -1]),
    )


def _compile(
    session: Session, request: CompilationRequest, map_request: MapRequest, callbacks: ProgressCallbacks
) -> CompiledMap:
    models = tuple(model for model in session.job.models if model.name == request.model)
    control = given_control(session.scenario, session.scene)
    return compile_map(
        session.person,
        replace(session.job, models=models, control={}),
        control,
        map_request,
        callbacks.on_point,
        callbacks.on_activity,
    )


# --- the document ------------------------------------------------------------------------------------------


def _map_document(compiled: CompiledMap, scene: Scene, scenario: Scenario) -> Document:
    lines = [_line_document(each, compiled, scene) for each in compiled.lines]
    errors = np.concatenate(
        [np.zeros(0), *(_height_errors(line, compiled, scene) for line in compiled.lines if line.kind == CONTOUR)]
    )
    at = compiled.model.on_ground(compiled.spots.readings)
    spot_errors = at[2] - scene.ground.height(at[0], at[1])
    return {
        "map_scale": compiled.map_scale,
        "model_scale": compiled.model.scale_number,
        "plan_gear": scenario.plan.plan_gear,
        "levelling": {
            "rounds": compiled.model.rounds,
            "tilt_left_gon": round(compiled.model.tilt_gon, 5),
            "scale_found": round(1e3 * compiled.model.metres_per_mm, 2),
        }
        | absolute_document(compiled.model.absolute),
        "expected": {"sigma_height_m": round(compiled.sigma_height, 4), "sigma_plan_m": round(compiled.sigma_plan, 4)},
        "spot_heights": int(np.isfinite(compiled.spots.heights).sum()),
        "range_m": [round(each, 2) for each in compiled.spots.range],
        "lines": lines,
        "beside_the_truth": {
            "spot_heights_rms_m": _rms(spot_errors[np.isfinite(spot_errors)]),
            "contours": _accuracy(errors, compiled) if errors.size else None,
        },
    }


def _accuracy(errors: Array, compiled: CompiledMap) -> Document:
    """Return rms height error of contours, the interval that it allows, and the flying height divided by that
    (C-factor).
    """
    rms = float(np.sqrt((errors**2).mean()))
    interval = HALF_INTERVAL_FACTOR * rms
    return {
        "rms_height_m": round(rms, 4),
        "mean_m": round(float(errors.mean()), 4),
        "largest_m": round(float(np.abs(errors).max()), 4),
        "per_mille_of_flying_height": round(1e3 * rms / compiled.height_above_ground, 4),
        "flying_height_m": round(compiled.height_above_ground, 1),
        "smallest_interval_m": round(interval, 3),
        "c_factor": round(compiled.height_above_ground / interval) if interval > 0.0 else None,
    }


def _line_document(traced: TracedLine, compiled: CompiledMap, scene: Scene) -> Document:
    at = compiled.model.on_ground(traced.readings)
    errors = _height_errors(traced, compiled, scene)
    document: Document = {
        "name": traced.name,
        "kind": traced.kind,
        "height_m": traced.height,
        "closed": traced.closed,
        "endings": list(traced.endings),
        "vertices": int(traced.readings.shape[1]),
        "length_m": round(float(length_of(np.diff(at[:2], axis=1)).sum()), 1),
        "rms_height_m": _rms(errors),
        "largest_height_m": round(float(np.abs(errors).max()), 4) if errors.size else None,
    }
    if traced.kind != CONTOUR:
        distances = np.array([float(scene.lines[traced.name].distance(place[:, None])[0]) for place in at[:2].T])
        document |= {"rms_off_m": _rms(distances), "largest_off_m": round(float(distances.max()), 4)}
    return document


def _height_errors(traced: TracedLine, compiled: CompiledMap, scene: Scene) -> Array:
    """Return the height errors of a line at its vertices ``(n,)``, m; positive if too high."""
    east, north, height = compiled.model.on_ground(traced.readings)
    line_heights = height if traced.height is None else np.full_like(height, traced.height)
    return np.asarray(line_heights - scene.ground.height(east, north))


def _rms(errors: Array | Sequence[float]) -> float | None:
    values = np.asarray(errors, dtype=float)
    if not values.size or not np.isfinite(values).all():
        return None
    return round(math.sqrt(float((values**2).mean())), 4)
