"""Picture carriers: the placement of a photograph in a projector."""

from dataclasses import dataclass

import numpy as np

from a7sim.geometry import GON, Array, plane_rotation
from a7sim.scene.camera import fiducial_places
from a7sim.scene.photograph import Photograph


@dataclass
class Carrier:
    """Photograph on its carrier: placed by hand, then shifted and rotated until it is centred."""

    photograph: Photograph
    placement: tuple[float, float, float]
    """Initial dx, dy in mm and dkappa in gon."""
    centring: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        self._set()

    def centre(self, dx: float, dy: float, dkappa: float) -> None:
        """Shift (mm) and rotate (gon) the picture from its initial placement."""
        self.centring = (dx, dy, dkappa)
        self._set()

    def _set(self) -> None:
        self._turn = plane_rotation((self.placement[2] + self.centring[2]) * GON)
        self._shift = np.array([self.placement[0] + self.centring[0], self.placement[1] + self.centring[1]])
        self._points: dict[str, Array] = {}

    def on_carrier(self, film: Array) -> Array:
        """Return film positions ``(2, ...)`` in mm as positions on the carrier about its collimating centre."""
        shift = self._shift.reshape((2,) + (1,) * (film.ndim - 1))
        return np.asarray(np.einsum("ij,j...->i...", self._turn, film) + shift)

    def on_film(self, carrier: Array) -> Array:
        """Return positions on the carrier ``(2, ...)`` as film positions: the inverse of `on_carrier`."""
        shift = self._shift.reshape((2,) + (1,) * (carrier.ndim - 1))
        return np.asarray(np.einsum("ji,j...->i...", self._turn, carrier - shift))

    def point(self, name: str) -> Array | None:
        """Return the position of an image point on the carrier ``(2,)``, None if there is no such point; read-only."""
        if name not in self._points:
            film = self.photograph.points.get(name)
            if film is None:
                return None
            self._points[name] = self._turn @ film + self._shift
            self._points[name].flags.writeable = False
        return self._points[name]

    def fiducial_displacements(self) -> list[tuple[str, float, float]]:
        """Return name, dx, dy in mm of each fiducial from its collimating mark."""
        names, calibrated = fiducial_places(self.photograph.camera)
        marks = {name: calibrated[:, i] for i, name in enumerate(names)}
        placed = self.on_carrier(self.photograph.fiducials.xy)
        return [
            (name, float(placed[0, i] - marks[name][0]), float(placed[1, i] - marks[name][1]))
            for i, name in enumerate(self.photograph.fiducials.names)
        ]
