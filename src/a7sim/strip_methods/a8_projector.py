"""Projectors of an A8 after its last adjustment: c, principal point and local errors of the projected bundle."""

from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array
from a7sim.instrument.local_errors import local_errors, smooth_local_errors
from a7sim.scenario import GridTest


@dataclass(frozen=True)
class Projector:
    """Projector after the last adjustment, mm in the plane of the picture."""

    principal_distance_error: float
    principal_point: Array
    local: Array
    """Coefficients ``(2, k)`` of smooth local errors, as `local_errors` takes them."""
    scattered: float

    @classmethod
    def sample(cls, test: GridTest, rng: np.random.Generator) -> "Projector":
        """Draw a projector of an instrument with these results of grid tests."""
        c, *point = rng.standard_normal(3) * [
            test.principal_distance_mm, test.principal_point_mm, test.principal_point_mm,
        ]  # fmt: skip
        local = smooth_local_errors(rng)
        smooth = test.local == "smooth"
        return cls(
            float(c),
            np.array(point),
            1e-3 * test.local_um * local * smooth,
            0.0 if smooth else 1e-3 * test.local_um,
        )

    def project(self, image: Array, rng: np.random.Generator) -> Array:
        """Return image points ``(2, n)`` about the principal point as projected by this projector."""
        scatter = self.scattered * rng.standard_normal(image.shape)
        return np.asarray(image + self.principal_point[:, None] + local_errors(self.local, image) + scatter)
