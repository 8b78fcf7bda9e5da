"""Comparison of the operator's results with the truth, which nowhere crosses the link."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from a7sim.geometry import GON, Array, angle_between, angles_of, length_of, mxm, mxv, rotation, transposed, turn_of
from a7sim.operator import ModelJob, ModelRecord
from a7sim.plotters import Variant
from a7sim.scene import RelativeTruth

ElementValues = Mapping[str, Any]
"""Counter readings of one session, or ``(m,)`` of a batch."""


@dataclass(frozen=True)
class RelativePose:
    """Right-hand photograph in the left-hand one's frame: rotation ``(3, 3, ...)`` and unit base ``(3, ...)``."""

    rotation: Array
    base: Array

    @classmethod
    def from_counters(cls, elements: ElementValues, model: ModelJob, variant: Variant) -> "RelativePose":
        """Return the relative orientation described by the counters ``(...)`` of a model."""
        left, right = model.left_projector, model.right_projector

        def rotation_of(n: int) -> Array:
            return rotation(*(tilt * GON for tilt in variant.tilts(elements, n)))

        base = _base_vector(elements, model)
        to_left = transposed(rotation_of(left))
        return cls(mxm(to_left, rotation_of(right)), mxv(to_left, base) / length_of(base))

    @classmethod
    def from_truth(cls, truth: RelativeTruth) -> "RelativePose":
        """Return a true or published relative orientation."""
        return cls(truth.rotation, truth.base / length_of(truth.base))

    def batch(self) -> "RelativePose":
        """Return the same for any number of sessions, with a batch axis at the end."""
        return RelativePose(self.rotation[..., None], self.base[..., None])

    def differences_gon(self, other: "RelativePose") -> tuple[Array, Array]:
        """Return the angles ``(...)`` between the rotations and between the bases."""
        turn = turn_of(mxm(transposed(self.rotation), other.rotation))
        return turn / GON, angle_between(self.base, other.base) / GON


def true_elements(
    truth: RelativePose, method: str, elements: ElementValues, model: ModelJob, variant: Variant
) -> dict[str, Array]:
    """Return the counter readings ``(m,)`` of the elements that a method turns if the truth were set.

    The other elements keep their readings. Independent: the left-hand camera is rotated so that the true base falls on
    the set one, and then about the base until omega" has its reading. Dependent: the left-hand camera stays, the
    right-hand one and its by and bz follow.
    """
    left, right = model.left_projector, model.right_projector
    set_base = _base_vector(elements, model)

    if method == "dependent":
        left_rotation = rotation(*(tilt * GON for tilt in variant.tilts(elements, left)))
        base = mxv(left_rotation, truth.base)
        base *= elements["bx"] / base[0]
        true = {
            f"by{right}": elements[f"by{left}"] - base[1],
            f"bz{right}": elements[f"bz{left}"] + base[2],
        }
        cameras = {right: mxm(left_rotation, truth.rotation)}
    else:
        left_rotation = _rotation_onto(truth.base, set_base)
        omega2 = variant.tilts(elements, 2)[0] * GON
        for _ in range(_MAX_TURNS):
            cameras = {left: left_rotation, right: mxm(left_rotation, truth.rotation)}
            left_rotation = mxm(_rotation_about(set_base, omega2 - angles_of(cameras[2])[0]), left_rotation)
        true = {}
    for n, camera in cameras.items():
        for name, radians in zip(("omega", "phi", "kappa"), angles_of(camera), strict=True):
            counter = radians / GON + variant.elements[f"{name}{n}"].zero
            true[f"{name}{n}"] = counter % 400.0 if name == "kappa" else counter
    return true


_MAX_TURNS = 12


def _base_vector(elements: ElementValues, model: ModelJob) -> Array:
    left, right = model.left_projector, model.right_projector
    across = elements.get(f"by{left}", 0.0) - elements.get(f"by{right}", 0.0)
    rise = elements.get(f"bz{right}", 0.0) - elements.get(f"bz{left}", 0.0)
    return np.array(np.broadcast_arrays(elements["bx"], across, rise), dtype=float)


def _rotation_about(axis: Array, angle: Array) -> Array:
    """Return the rotations ``(3, 3, m)`` by angles about axes ``(3, m)`` (Rodrigues); none about a zero axis."""
    length = length_of(axis)
    x, y, z = axis / np.where(length > 0.0, length, 1.0)
    zero = np.zeros_like(x)
    skew = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]])
    return np.asarray(np.eye(3)[:, :, None] + np.sin(angle) * skew + (1.0 - np.cos(angle)) * mxm(skew, skew))


def _rotation_onto(vector: Array, other: Array) -> Array:
    """Return the smallest rotations ``(3, 3, m)`` that turn vectors into the direction of others."""
    return _rotation_about(np.cross(vector, other, axis=0), angle_between(vector, other))


@dataclass(frozen=True)
class RelativeComparison:
    """True relative orientation of m sessions compared with that of their counters."""

    source: str
    true: RelativePose
    """One for all."""
    found: RelativePose
    rotation_gon: Array
    """Angles ``(m,)`` between the rotations."""
    base_gon: Array
    elements: Mapping[str, Array]
    """Counter readings ``(m,)`` if the truth were set."""


@dataclass(frozen=True)
class TruthComparison:
    """Truth about a model in m sessions; the last axis of arrays contains the sessions."""

    centres: Mapping[int, Mapping[str, Array]]
    """True centres ``(m,)``, in counter units, by side (1 left, 2 right)."""
    relative: RelativeComparison | None
    """None if no truth is known."""

    @classmethod
    def of(
        cls,
        truth: RelativeTruth | None,
        centres: Mapping[int, Mapping[str, Array]],
        method: str,
        elements: Mapping[str, Array],
        model: ModelJob,
        variant: Variant,
    ) -> "TruthComparison":
        """Return the truth for the elements ``(m,)`` of sessions that turned them by a method."""
        if truth is None:
            return cls(centres, None)
        true, found = RelativePose.from_truth(truth), RelativePose.from_counters(elements, model, variant)
        exact = true_elements(true.batch(), method, elements, model, variant)
        return cls(centres, RelativeComparison(truth.source, true, found, *found.differences_gon(true.batch()), exact))

    @classmethod
    def from_record(cls, record: ModelRecord, pose: "TruePose", truth: RelativeTruth | None) -> "TruthComparison":
        """Return the truth about one session, with its instrument in the final state."""
        model = record.model
        centres = {
            side: {name: np.array([value]) for name, value in true_centre(pose, projector).items()}
            for side, projector in ((1, model.left_projector), (2, model.right_projector))
        }
        elements = {name: np.array([value]) for name, value in record.orientation.elements.items()}
        return cls.of(truth, centres, record.orientation.method, elements, model, pose.variant)


class TruePose(Protocol):
    """True state of an instrument: poses of its projectors and position of its mark."""

    variant: Variant

    def pose(self, projector: int) -> tuple[Array, Array]:
        """Return centre ``(3,)`` in mm and rotation ``(3, 3)`` of a projector."""

    def readings_at(self, place: Array) -> dict[str, float]:
        """Return the counter readings, unrounded, with the mark at a position ``(3,)``."""


def true_centre(autograph: TruePose, projector: int) -> dict[str, float]:
    """Return the true position of a projection centre, in counter units."""
    centre, _ = autograph.pose(projector)
    readings = autograph.readings_at(centre)
    return {f"{axis}0": readings[axis] for axis in "XYZ"}
