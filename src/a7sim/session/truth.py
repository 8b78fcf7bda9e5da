"""The truth beside what the operator found. It is compared here and nowhere crosses the link."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from a7sim.geometry import GON, Array, angle_between, angles_of, length_of, mxm, mxv, rotation, transposed, turn_of
from a7sim.manual import Variant
from a7sim.operator import ModelJob
from a7sim.scene import RelativeTruth


@dataclass(frozen=True)
class Relative:
    """The right-hand photograph in the left-hand one's frame: rotation ``(3, 3)`` and unit base ``(3,)``."""

    rotation: Array
    base: Array

    @classmethod
    def of_counters(cls, elements: Mapping[str, float], model: ModelJob, variant: Variant) -> "Relative":
        """Return the relative orientation that the counters of a model describe."""
        left, right = model.left_projector, model.right_projector

        def turned(n: int) -> Array:
            return rotation(*(tilt * GON for tilt in variant.tilts(elements, n)))

        base = _base_of(elements, model)
        to_left = transposed(turned(left))
        return cls(mxm(to_left, turned(right)), mxv(to_left, base) / length_of(base))

    @classmethod
    def of_truth(cls, truth: RelativeTruth) -> "Relative":
        """Return a true or published relative orientation."""
        return cls(truth.rotation, truth.base / length_of(truth.base))

    def differences_gon(self, other: "Relative") -> tuple[float, float]:
        """Return by what angles the rotations and the bases differ."""
        turn = float(turn_of(mxm(transposed(self.rotation), other.rotation)))
        return turn / GON, float(angle_between(self.base, other.base)) / GON


def true_elements(
    truth: Relative, method: str, elements: Mapping[str, float], model: ModelJob, variant: Variant
) -> dict[str, float]:
    """Return what the counters of the elements that a method turns would show if the truth were set.

    The other elements stay as they are. Independent: the left-hand camera brings the true base onto the set one and
    is turned about it until omega" shows what it shows. Dependent: the left-hand camera stays, the right-hand one and
    its by and bz follow.
    """
    left, right = model.left_projector, model.right_projector
    set_base = _base_of(elements, model)

    if method == "dependent":
        turned_left = rotation(*(tilt * GON for tilt in variant.tilts(elements, left)))
        base = mxv(turned_left, truth.base)
        base *= elements["bx"] / base[0]
        true = {
            f"by{right}": elements[f"by{left}"] - float(base[1]),
            f"bz{right}": elements[f"bz{left}"] + float(base[2]),
        }
        cameras = {right: mxm(turned_left, truth.rotation)}
    else:
        turned_left = _laid_onto(truth.base, set_base)
        omega2 = variant.tilts(elements, 2)[0] * GON
        for _ in range(_MOST_TURNS):
            cameras = {left: turned_left, right: mxm(turned_left, truth.rotation)}
            turned_left = mxm(_about(set_base, omega2 - float(angles_of(cameras[2])[0])), turned_left)
        true = {}
    for n, turned in cameras.items():
        for name, radians in zip(("omega", "phi", "kappa"), angles_of(turned), strict=True):
            shown = float(radians) / GON + variant.elements[f"{name}{n}"].zero
            true[f"{name}{n}"] = shown % 400.0 if name == "kappa" else shown
    return true


_MOST_TURNS = 12


def _base_of(elements: Mapping[str, float], model: ModelJob) -> Array:
    left, right = model.left_projector, model.right_projector
    return np.array(
        [
            elements["bx"],
            elements.get(f"by{left}", 0.0) - elements.get(f"by{right}", 0.0),
            elements.get(f"bz{right}", 0.0) - elements.get(f"bz{left}", 0.0),
        ]
    )


def _about(axis: Array, angle: float) -> Array:
    """Return the rotation ``(3, 3)`` through an angle about an axis (Rodrigues)."""
    x, y, z = axis / length_of(axis)
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew)


def _laid_onto(vector: Array, other: Array) -> Array:
    """Return the smallest rotation ``(3, 3)`` that brings a vector into the direction of another."""
    if not np.cross(vector, other).any():
        return np.eye(3)
    return _about(np.cross(vector, other), float(angle_between(vector, other)))


class Standing(Protocol):
    """An instrument as the truth sees it: where its projectors and its mark really stand."""

    variant: Variant

    def pose(self, projector: int) -> tuple[Array, Array]:
        """Return centre ``(3,)`` in mm and rotation ``(3, 3)`` of a projector."""

    def readings_at(self, place: Array) -> dict[str, float]:
        """Return what the counters would show, unrounded, with the mark at a place ``(3,)``."""


def true_centre(autograph: Standing, projector: int) -> dict[str, float]:
    """Return where a projection centre really stands, in counter units."""
    centre, _ = autograph.pose(projector)
    readings = autograph.readings_at(centre)
    return {f"{axis}0": readings[axis] for axis in "XYZ"}
