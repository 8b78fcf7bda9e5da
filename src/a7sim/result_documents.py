"""Documents of results: the contents of `--json` and `results.json` (files.md), the same for all commands."""

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec
import numpy as np

from a7sim.geometry import GON, Array
from a7sim.reduction.absolute import AbsoluteOrientation, GroundFit, max_abs_residual, root_mean_square
from a7sim.reduction.least_squares import Adjustment
from a7sim.reduction.polynomials import StripAdjustment
from a7sim.reduction.similarity import Similarity
from a7sim.reduction.strips import Strip

SCHEMA_VERSION = 1

Document = dict[str, Any]


def document_header(command: str) -> Document:
    """Return the first keys of a document."""
    return {"schema_version": SCHEMA_VERSION, "command": command}


def as_json(document: Document) -> str:
    """Return a document as indented JSON with a line end."""
    return msgspec.json.format(msgspec.json.encode(document), indent=2).decode() + "\n"


def points_as_rows(points: Sequence[str], values: Array) -> dict[str, list[float]]:
    """Return values ``(k, n)`` as a list of k for each of n points."""
    return dict(zip(points, values.T.tolist(), strict=True))


def elements_document(values: Mapping[str, Array], sigmas: Mapping[str, Array]) -> Document:
    """Return elements with their standard deviations, angles in gon."""
    units = {name: 1.0 if name.startswith("b") else GON for name in values}
    return {
        name: {"value": float(value) / units[name], "sigma": float(sigmas[name]) / units[name]}
        for name, value in values.items()
    }


def statistics_document(adjustment: Adjustment, names: Sequence[str], observations: Sequence[str]) -> Document:
    """Return the statistics of an adjustment with named unknowns and observations; correlations row by row."""
    return {
        "unknowns": list(names),
        "correlations": adjustment.correlations.tolist(),
        "redundancy": int(adjustment.redundancy),
        "redundancy_numbers": dict(zip(observations, adjustment.redundancy_numbers.tolist(), strict=True)),
        "condition": float(adjustment.condition),
    }


def similarity_document(similarity: Similarity) -> Document:
    """Return scale, rotation and translation."""
    return {
        "scale": float(similarity.scale),
        "rotation": similarity.rotation.tolist(),
        "translation": similarity.translation.tolist(),
    }


def joins_document(strip: Strip) -> list[Document]:
    """Return the joins of a strip's models."""
    return [
        {
            "models": [join.before, join.after],
            "scale": float(join.scale),
            "rotation": join.similarity.rotation.tolist(),
            "max_residual_mm": float(join.max_residual),
        }
        for join in strip.joins
    ]


def absolute_document(oriented: AbsoluteOrientation) -> Document:
    """Return an absolute orientation with its residuals, accuracy and warnings."""
    return {
        "absolute": similarity_document(oriented.similarity),
        "residuals_m": residuals_document(oriented.fit),
        "accuracy_m": accuracy_document(oriented.fit),
        "warnings": list(oriented.warnings),
    }


def adjustment_document(adjusted: StripAdjustment) -> Document:
    """Return a polynomial adjustment: its residuals and the deformation of the strip."""
    deformation = adjusted.deformation
    return {
        "degree": adjusted.degree,
        "s0_plan": float(adjusted.plan.s0),
        "s0_height": float(adjusted.height.s0),
        "deformation": {
            "scale_drift_ppm_per_km": 1e9 * float(deformation.scale_drift),
            "horizontal_sag_m": float(deformation.horizontal_sag),
            "vertical_sag_m": float(deformation.vertical_sag),
            "twist_gon_per_km": 1e3 * float(deformation.twist) / GON,
        },
        "residuals_m": residuals_document(adjusted.fit),
        "accuracy_m": accuracy_document(adjusted.fit),
    }


def residuals_document(fit: GroundFit) -> Document:
    """Return computed minus given at each ground point, with its role; null where nothing is given."""
    return {
        point: {"role": role} | {axis: _finite_or_none(value) for axis, value in zip("XYZ", residual, strict=True)}
        for point, role, residual in zip(fit.ground.points, fit.ground.roles, fit.residuals.T.tolist(), strict=True)
    }


def accuracy_document(fit: GroundFit) -> Document:
    """Return rms and largest residuals at control and at checks; `plan` is the rms distance in plan."""
    return {
        group: differences_document(residuals)
        for group, residuals in (("control", fit.at_control), ("checks", fit.at_checks))
        if np.isfinite(residuals).any()
    }


def differences_document(residuals: Array) -> Document:
    """Return rms and largest of differences ``(3, n)`` in X, Y and Z, nan left out."""
    rms, largest = root_mean_square(residuals), max_abs_residual(residuals)
    return {
        "points": int(np.isfinite(residuals).any(axis=0).sum()),
        "rms": {axis: _finite_or_none(float(value)) for axis, value in zip("XYZ", rms, strict=True)},
        "plan": _finite_or_none(float(np.hypot(rms[0], rms[1]))),
        "height": _finite_or_none(float(rms[2])),
        "largest": {axis: _finite_or_none(float(value)) for axis, value in zip("XYZ", largest, strict=True)},
    }


def _finite_or_none(value: float) -> float | None:
    return value if np.isfinite(value) else None
