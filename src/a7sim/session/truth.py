"""The truth beside what the operator found. It is compared here and nowhere crosses the link."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from a7sim.geometry import GON, Array, angle_between, length_of, mxm, mxv, rotation, transposed, turn_of
from a7sim.instrument import Autograph
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
            omega, phi, kappa = (
                elements[f"{name}{n}"] - variant.elements[f"{name}{n}"].zero for name in ("omega", "phi", "kappa")
            )
            return rotation(omega * GON, phi * GON, kappa * GON)

        base = np.array(
            [
                elements["bx"],
                elements[f"by{left}"] - elements[f"by{right}"],
                elements[f"bz{right}"] - elements[f"bz{left}"],
            ]
        )
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


def true_centre(autograph: Autograph, projector: int) -> dict[str, float]:
    """Return where a projection centre really stands, in counter units."""
    centre, _ = autograph.pose(projector)
    readings = autograph.readings_at(centre)
    return {f"{axis}0": readings[axis] for axis in "XYZ"}
