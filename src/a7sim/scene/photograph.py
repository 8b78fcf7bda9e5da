"""Photograph: film with fiducials, named image points and optional image content."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import compress

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array
from a7sim.scenario.schema import Camera, FilmDeformation

SKETCH_SIGMA_MM = 0.3
"""Points are pricked on the paper print to about half a millimetre (protocol.md)."""

_NO_DEFORMATION = np.eye(2)

Content = Callable[[Array, float], Array]
"""Grey values 0..1 ``(...)`` of picture elements at film positions ``(2, ...)`` with a width in mm on film."""


@dataclass(frozen=True)
class NamedPoints:
    """Named positions on film: names in order and coordinates ``(2, n)`` in mm."""

    names: tuple[str, ...]
    xy: Array

    @cached_property
    def _places(self) -> dict[str, Array]:
        return {name: self.xy[:, i] for i, name in enumerate(self.names)}

    def get(self, name: str) -> Array | None:
        """Return the position ``(2,)`` of a mark, None if there is no such name."""
        return self._places.get(name)


@dataclass(frozen=True)
class Photograph:
    """Film coordinates in mm from the fiducial centre, and the image content."""

    name: str
    camera: Camera
    fiducials: NamedPoints
    points: NamedPoints
    sketch: NamedPoints
    polarity: str = "positive"
    placement: str = "right way up"
    content: Content | None = field(default=None, compare=False)


def prick_points(points: NamedPoints, rng: np.random.Generator) -> NamedPoints:
    """Return the points as pricked on the paper print."""
    return NamedPoints(points.names, points.xy + rng.normal(0.0, SKETCH_SIGMA_MM, points.xy.shape))


@dataclass(frozen=True)
class Deformation:
    """Affine and irregular deformation of the film of one photograph."""

    matrix: Array
    irregular_mm: float
    identification_mm: float

    @classmethod
    def sample(cls, film: FilmDeformation, rng: np.random.Generator) -> "Deformation":
        """Draw the deformation of one photograph on this film."""
        shrink = np.asarray(film.shrinkage_ppm) + film.shrinkage_sigma_ppm * rng.standard_normal(2)
        shear = film.shear_sigma_ppm * rng.standard_normal()
        matrix = _NO_DEFORMATION - 1e-6 * np.array([[shrink[0], shear], [shear, shrink[1]]])
        return cls(matrix, film.irregular_um / 1000.0, film.identification_um / 1000.0)

    def of_fiducials(self, xy: Array, rng: np.random.Generator) -> Array:
        """Return fiducials ``(2, n)`` as imaged on the film."""
        return np.asarray(self.matrix @ xy + self.irregular_mm * rng.standard_normal(xy.shape))

    def of_points(self, xy: Array, rng: np.random.Generator) -> Array:
        """Return image points ``(2, n)`` as imaged on the film and identified."""
        spread = np.hypot(self.irregular_mm, self.identification_mm)
        return np.asarray(self.matrix @ xy + spread * rng.standard_normal(xy.shape))


def within_format(xy: Array, half_width_mm: float = 107.0) -> npt.NDArray[np.bool_]:
    """Return which positions ``(2, n)`` lie in the usable part of the format."""
    return np.asarray((np.abs(xy) <= half_width_mm).all(axis=0))


def select(marks: NamedPoints, keep: Sequence[bool] | npt.NDArray[np.bool_]) -> NamedPoints:
    """Return the marks for which `keep` is true."""
    kept = np.asarray(keep, dtype=bool)
    if kept.all():
        return marks
    return NamedPoints(tuple(compress(marks.names, kept.tolist())), marks.xy[:, kept])
