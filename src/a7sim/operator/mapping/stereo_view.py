"""Stereoscopic view of the ground at the mark: the images of both eyepieces, fused.

The eyepieces show texture only. Two eyes see a surface above or below the mark, and its slope. Here that is
least-squares matching of the two images: the surface is a plane in the model, turned and raised until its left and
right images agree. The procedures add the errors of the observer.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from a7sim.geometry import GON, Array, image_of, plane_rotation, rotation
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.people.person import Person

SIDE = 48
"""Columns and rows of an image."""

FINE_MM, MIDDLING_MM, COARSE_MM = 0.03, 0.07, 0.2
"""Size of a picture element at photo scale; the finest image shows 1.44 mm of the photograph."""

FUSED = 0.95
"""Correlation from which two images count as the same ground.

It is 0.97 and more on bare ground, and less elsewhere (docs/compilation.md).
"""

_PATCH = 31
"""Number of positions in each direction at which the images are compared, one per picture element."""

_MARK_RADIUS = 3.5
"""Radius in picture elements of the part covered by the mark, including the effect of interpolation."""

_MAX_STEPS = 12
_AT_REST = 2e-4
_STEEPEST = 1.0
_NUDGE_MM = 0.05


@dataclass(frozen=True)
class PerceivedSurface:
    """Ground surface about the mark as seen by both eyes; lengths in mm at model scale."""

    height: float
    """Of the ground above the mark, vertically."""
    slope: Array
    """Along X and Y ``(2,)``."""
    y_parallax: float
    """mm at photo scale, left eye minus right eye."""
    correlation: float

    def above(self, plan: Array) -> float:
        """Return the height of the ground above the mark at a displacement in plan ``(2,)``."""
        return float(self.height + self.slope @ plan)

    @property
    def fused(self) -> bool:
        """Whether the two images were fused."""
        return self.correlation >= FUSED


@dataclass(frozen=True)
class StereoPatch:
    """Images of both eyes ``(2, rows, columns)`` and the projection of model displacements into them."""

    pictures: Array
    pitch: float
    """mm at photo scale."""
    shown: Array
    """From displacements in the model to those in the images ``(2 eyes, 2, 3)``."""
    spacing: float
    """mm in the model per picture element."""

    @property
    def parallax_by_height(self) -> float:
        """x-parallax at photo scale per mm of height in the model."""
        return float(abs(self.shown[0, 0, 2] - self.shown[1, 0, 2]))

    @property
    def enlargement(self) -> float:
        """Size in the model by size in the photographs."""
        return self.spacing / self.pitch

    @cached_property
    def comparison_points(self) -> Array:
        """Displacements in plan ``(2, n)`` of the positions at which the images are compared, mm in the model."""
        return self.patch(_PATCH)

    def patch(self, side: int) -> Array:
        """Return displacements in plan ``(2, n)`` over `side` picture elements in each direction, mm in the model."""
        at = self.spacing * (np.arange(side) - (side - 1) / 2.0)
        return np.array(np.meshgrid(at, at)).reshape(2, -1)

    def elements_at(self, seen: Array) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
        """Return columns and rows ``(..., n)`` of positions ``(..., 2, n)``, and which are usable.

        A position is usable if the image shows it and the mark does not cover it.
        """
        columns = seen[..., 0, :] / self.pitch + (SIDE - 1) / 2.0
        rows = -seen[..., 1, :] / self.pitch + (SIDE - 1) / 2.0
        inside = (columns >= 0) & (columns < SIDE - 1) & (rows >= 0) & (rows < SIDE - 1)
        uncovered = np.hypot(seen[..., 0, :], seen[..., 1, :]) > _MARK_RADIUS * self.pitch
        return columns, rows, inside & uncovered

    def places(self, surface: Array) -> tuple[Array, Array]:
        """Return displacements ``(2, n)`` over the patch and their positions in both images on a surface ``(2, 2, n)``.

        `surface` is height, slope in X, slope in Y in the model, and y-parallax at photo scale.
        """
        plan = self.comparison_points
        raised = np.concatenate([plan, [surface[0] + surface[1:3] @ plan]])
        seen = self.shown @ raised
        seen[0, 1] += surface[3] / 2.0
        seen[1, 1] -= surface[3] / 2.0
        return plan, seen


class StereoView:
    """Stereoscopic view of one operator at a link, of the ground at the mark."""

    def __init__(self, workstation: Workstation, person: Person) -> None:
        self._workstation = workstation
        self._person = person
        self._active = np.zeros(1, dtype=np.intp)
        self._elements: dict[str, float] = {}
        self.read_projectors()

    def read_projectors(self) -> None:
        """Read the poses of the projectors."""
        names = [f"{name}{n}" for name in ("kappa", "phi", "omega", "by", "bz", "c") for n in (1, 2)]
        counts = self._workstation.controls.elements(self._active, [*names, "bx"])
        self._elements = {name: float(each[0]) for name, each in counts.items()}

    def camera(self, side: int) -> tuple[Array, Array]:
        """Return centre ``(3,)`` and rotation ``(3, 3)`` of the left-hand (1) or right-hand (2) photograph's camera."""
        n = self._workstation.controls.projector(side)
        turned = rotation(*(tilt * GON for tilt in self._workstation.controls.manual.tilts(self._elements, n)))
        x = 0.0 if side == 1 else self._elements["bx"]
        centre = np.array([x, -self._elements[f"by{n}"], self._elements[f"bz{n}"]])
        return centre, turned

    def displacements(self, mark: Array) -> Array:
        """Return the derivatives ``(2 eyes, 2, 3)`` of the view by displacements from the mark ``(3,)``."""
        steps = _NUDGE_MM * np.concatenate([np.eye(3), -np.eye(3)], axis=1)
        seen = []
        for side in (1, 2):
            n = self._workstation.controls.projector(side)
            centre, turned = self.camera(side)
            images = image_of((mark[:, None] + steps), centre[:, None], turned, self._elements[f"c{n}"])
            swing = plane_rotation(self._elements[f"kappa{n}"] * GON)
            seen.append(swing @ (images[:, :3] - images[:, 3:]) / (2.0 * _NUDGE_MM))
        return np.array(seen)

    def look(self, pitch: float = FINE_MM) -> StereoPatch:
        """Look with both eyes and return the images.

        `pitch` is the size of a picture element in mm of the photographs. The caller adds the time.
        """
        workstation = self._workstation
        mark = workstation.controls.model_position(self._active, workstation.controls.counters(self._active))[:, 0] * (
            1.0,
            1.0,
            -1.0,
        )
        magnification = 2.0 * workstation.controls.manual.field_radius_mm / (SIDE * pitch)
        pictures = np.array([self._picture(eye, magnification) for eye in (1, 2)])
        shown = self.displacements(mark)
        return StereoPatch(pictures, pitch, shown, pitch / float(np.abs(np.linalg.det(shown[0, :, :2])) ** 0.5))

    def _picture(self, eye: int, magnification: float) -> Array:
        block = self._person.client.block(f"EYEP{eye}:PICT? {SIDE},{SIDE},{magnification:.6g}")
        return np.frombuffer(block, dtype=np.uint8).reshape(SIDE, SIDE) / 255.0

    def surface(
        self, look: StereoPatch, expected: PerceivedSurface | None = None, reach: float = 0.0
    ) -> PerceivedSurface:
        """Return the ground shown by a look, starting with an expected slope.

        Heights within `reach` mm of the mark are tried; without it the ground is expected at the mark's height.
        """
        start = np.zeros(4)
        if expected is not None:
            start[1:3] = expected.slope
            start[0] = expected.height
        if reach:
            per_element = look.pitch / look.parallax_by_height
            heights = start[0] + np.arange(-reach, reach + per_element, 0.75 * per_element)
            tried = [_correlation(look, np.array([h, *start[1:]])) for h in heights]
            start[0] = heights[int(np.argmax(tried))]
        return _match_surface(look, start)


def _match_surface(look: StereoPatch, surface: Array) -> PerceivedSurface:
    """Return the plane for which both images agree best, by Gauss-Newton from a plane nearby."""
    scale = np.array([1.0, 10.0, 10.0, 1.0])
    for _ in range(_MAX_STEPS):
        left, right, left_slopes, right_slopes, plan = _compare_images(look, surface)
        if left.size < _PATCH:
            return PerceivedSurface(0.0, np.zeros(2), 0.0, 0.0)
        left_spread, right_spread = left.std(), right.std()
        if not left_spread * right_spread:
            return PerceivedSurface(0.0, np.zeros(2), 0.0, 0.0)
        by_height = (left_slopes * look.shown[0, :, 2:]).sum(axis=0) / left_spread - (
            right_slopes * look.shown[1, :, 2:]
        ).sum(axis=0) / right_spread
        by_parallax = (left_slopes[1] / left_spread + right_slopes[1] / right_spread) / 2.0
        design = np.array([by_height, by_height * plan[0], by_height * plan[1], by_parallax, np.ones(left.size)]).T
        misfit = (left - left.mean()) / left_spread - (right - right.mean()) / right_spread
        step = np.linalg.lstsq(design, -misfit, rcond=None)[0][:4]
        surface = surface + step
        surface[1:3] = np.clip(surface[1:3], -_STEEPEST, _STEEPEST)
        if np.abs(step * scale).max() < _AT_REST:
            break
    return PerceivedSurface(float(surface[0]), surface[1:3].copy(), float(surface[3]), _correlation(look, surface))


def _compare_images(look: StereoPatch, surface: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Return the greys of a surface in both images, their gradients, and the positions.

    Greys ``(n,)``, gradients per mm ``(2, n)``, positions ``(2, n)``. Positions covered by the mark or outside either
    image are left out.
    """
    samples, plan = _sample_both_images(look, surface)
    sense = np.array([[1.0], [-1.0]])
    left_slopes, right_slopes = (each.slopes * sense / look.pitch for each in samples)
    return samples[0].greys, samples[1].greys, left_slopes, right_slopes, plan


def _sample_both_images(look: StereoPatch, surface: Array) -> tuple[list["_GreySamples"], Array]:
    """Return the positions where both images show a surface clear of the mark, and the displacements ``(2, n)``."""
    plan, seen = look.places(surface)
    columns, rows, plain = look.elements_at(seen)
    keep = plain.all(axis=0)
    samples = [_GreySamples.from_picture(look.pictures[eye], columns[eye, keep], rows[eye, keep]) for eye in (0, 1)]
    return samples, plan[:, keep]


@dataclass(frozen=True)
class _GreySamples:
    """Positions ``(n,)`` between picture elements.

    Fractions to the right and down, and the greys about them with their differences.
    """

    to_right: Array
    down: Array
    upper: Array
    upper_change: Array
    lower: Array
    lower_change: Array

    @classmethod
    def from_picture(cls, picture: Array, columns: Array, rows: Array) -> "_GreySamples":
        j, i = columns.astype(np.intp), rows.astype(np.intp)
        first, width, elements = i * picture.shape[1] + j, picture.shape[1], picture.ravel()
        a, c = elements.take(first), elements.take(first + width)
        return cls(columns - j, rows - i, a, elements.take(first + 1) - a, c, elements.take(first + (width + 1)) - c)

    @cached_property
    def _ends(self) -> tuple[Array, Array]:
        upper = self.upper + self.upper_change * self.to_right
        return upper, self.lower + self.lower_change * self.to_right - upper

    @property
    def greys(self) -> Array:
        """Greys ``(n,)``."""
        upper, difference = self._ends
        return upper + difference * self.down

    @property
    def slopes(self) -> Array:
        """Differences of grey by column and row ``(2, n)``."""
        return np.array([self.upper_change * (1.0 - self.down) + self.lower_change * self.down, self._ends[1]])


def _correlation(look: StereoPatch, surface: Array) -> float:
    """Return the correlation of the greys of a surface in both images."""
    left, right = (each.greys for each in _sample_both_images(look, surface)[0])
    spread = float(left.std() * right.std()) if left.size >= _PATCH else 0.0
    return float(((left - left.mean()) * (right - right.mean())).mean()) / spread if spread > 0.0 else 0.0


def rectify(look: StereoPatch, surface: PerceivedSurface, side: int) -> tuple[npt.NDArray[np.bool_], Array, Array]:
    """Return the view of the left eye projected onto the ground.

    The result is the visibility and the greys, both ``(n,)``, and the positions ``(2, n)``. The patch has `side`
    picture elements in each direction; positions are displacements from the mark in plan, mm in the model.
    """
    plan = look.patch(side)
    seen = look.shown[0] @ np.concatenate([plan, [surface.height + surface.slope @ plan]])
    columns, rows, inside = look.elements_at(seen)
    grey = np.zeros(inside.size)
    grey[inside] = _GreySamples.from_picture(look.pictures[0], columns[inside], rows[inside]).greys
    return inside, grey, plan
