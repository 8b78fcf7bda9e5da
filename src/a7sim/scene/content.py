"""Content of a photograph: ground, lines, houses and signals where the ray of an image point meets the ground."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from a7sim.geometry import Array, length_of, ray_of
from a7sim.scenario.schema import Camera
from a7sim.scene.camera import fall_off
from a7sim.scene.coverage import within_band
from a7sim.scene.emulsion import Emulsion
from a7sim.scene.houses import NO_HOUSES, Houses, houses_along
from a7sim.scene.lines import GroundLine, distance_from, with_lines
from a7sim.scene.noise import value_noise
from a7sim.scene.photograph import Content, NamedPoints
from a7sim.scene.terrain import GroundSurface

SIGNAL_MM = 0.12
"""Half the arm of a signal on film."""

WATER_TONE = 0.2
"""Grey of still water from above, without any detail [assumption]."""

_OCTAVES_M = (160.0, 47.0, 13.0, 3.7, 1.1)


def ground_texture(east: Array, north: Array) -> Array:
    """Return grey values 0..1 of the ground in several octaves, the same for all photographs."""
    grey: Array = np.full(np.shape(east), 0.5)
    for octave, length in enumerate(_OCTAVES_M):
        grey += 0.28 * 0.72**octave * value_noise(east / length, north / length, octave)
    return np.asarray(np.clip(grey, 0.0, 1.0))


def signals(points: NamedPoints) -> Content:
    """Return a function that gives the share 0..1 of picture elements at ``(2, ...)`` covered by a white cross."""

    def covered(xy: Array, element: float) -> Array:
        cover = np.zeros(xy.shape[1:])
        places = xy.reshape(2, -1)
        reach = SIGNAL_MM + element / 2.0
        low, high = places.min(axis=1)[:, None] - reach, places.max(axis=1)[:, None] + reach
        for i in np.flatnonzero(((points.xy > low) & (points.xy < high)).all(axis=0)):
            offset = xy - points.xy[:, i].reshape((2,) + (1,) * (xy.ndim - 1))
            long_x, long_y = (within_band(each, SIGNAL_MM, element) for each in offset)
            narrow_x, narrow_y = (within_band(each, SIGNAL_MM / 4.0, element) for each in offset)
            crossing = narrow_x * narrow_y
            round_hole = np.minimum(within_band(length_of(offset), SIGNAL_MM / 4.0, element), crossing)
            hole = round_hole if element < SIGNAL_MM / 2.0 else np.pi / 4.0 * crossing
            cover = np.maximum(cover, long_x * narrow_y + long_y * narrow_x - crossing - hole)
        return cover

    return covered


@dataclass(frozen=True)
class GroundAppearance:
    """Objects on the ground, the same in all photographs."""

    ground: GroundSurface
    lines: Sequence[GroundLine]
    houses_seed: int | None
    """Seed of the houses along the lines; None for no houses."""

    @cached_property
    def houses(self) -> Houses:
        """Houses, computed on first use."""
        return NO_HOUSES if self.houses_seed is None else houses_along(self.lines, self.ground, self.houses_seed)

    def grey(self, plan: Array, element: float) -> Array:
        """Return the grey ``(...)`` of ground positions ``(2, ...)`` in m for picture elements of this width on the
        ground.
        """
        grey = with_lines(self.lines, plan, ground_texture(plan[0], plan[1]), element)
        grey = self.houses.over(plan, grey, element)
        return grey + self._flooded(plan, element) * (WATER_TONE - grey) if self.ground.shores else grey

    def _flooded(self, plan: Array, element: float) -> Array:
        """Return the share 0..1 of picture elements that is water."""
        wet = self.ground.under_water(plan)
        if element <= 0.0:
            return wet.astype(float)
        closed = [np.concatenate([shore, shore[:, :1]], axis=1) for shore in self.ground.shores]
        off = np.min([distance_from(shore, plan, element) for shore in closed], axis=0) / element
        return np.asarray(np.clip(0.5 + np.where(wet, off, -off), 0.0, 1.0))


@dataclass(frozen=True)
class GroundImage:
    """Image of the ground from a station.

    `to_film` is the affine deformation ``(2, 2)`` of the film; `imaging` applies air and lens to perspective images.
    Without an emulsion there is neither blur nor grain, and the light is even.
    """

    appearance: GroundAppearance
    centre: Array
    rotation: Array
    camera: Camera
    to_film: Array
    points: NamedPoints
    imaging: Callable[[Array], Array]
    emulsion: Emulsion | None

    @cached_property
    def _from_film(self) -> Array:
        return np.asarray(np.linalg.inv(self.to_film))

    @cached_property
    def _covered(self) -> Content:
        return signals(self.points)

    def __call__(self, xy: Array, element: float) -> Array:
        """Return the greys 0..1 ``(...)`` of picture elements at film positions ``(2, ...)``, `element` mm wide."""
        edge = self.emulsion.resolved(element) if self.emulsion else element
        perspective = _undone(self.imaging, np.einsum("ij,j...->i...", self._from_film, xy))
        met = self.appearance.ground.intersect(self.centre, ray_of(perspective, self.rotation, self.camera.c))
        scale = (self.centre[2] - self.appearance.ground.mean_height) / self.camera.c
        grey = self.appearance.grey(met[:2], scale * edge)
        cover = self._covered(xy, edge)
        if self.emulsion is None:
            return np.asarray(np.maximum(grey, cover))
        light = fall_off(self.camera, perspective) * (grey + cover * (1.0 - grey))
        return self.emulsion.exposed(xy, light, element)


def _undone(imaging: Callable[[Array], Array], imaged: Array) -> Array:
    """Return the images that `imaging` maps to the given positions, by fixed-point iteration."""
    image = imaged
    for _ in range(4):
        image = image + (imaged - imaging(image))
    return image


def marks_image(points: NamedPoints) -> Content:
    """Return the image of measured points: signals on grey."""
    covered = signals(points)
    return lambda xy, element: np.maximum(0.45, covered(xy, element))


def point_sampled(content: Content) -> Content:
    """Return an image sampled at points: all edges are sharp, and narrow objects may be missed."""
    return lambda xy, _: content(xy, 0.0)
