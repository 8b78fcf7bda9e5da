"""Grid plate: its placement on the carrier, and pointings at its crosses."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices
from a7sim.geometry import Array
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.procedures.interior import view_fiducials
from a7sim.reduction import PlatePlacement, plane_fit, plate_placement
from a7sim.scenario import Camera

Crosses = Mapping[str, tuple[float, float]]
"""Names and nominal positions in mm."""

MAX_SLIP_SIGMAS = 4.5
"""Distance from the position given by the other crosses beyond which a cross is measured again, in standard deviations.

Of 3000 good crosses on plates of 25, one is measured again.
"""

MIN_SLIP_MM = 0.01
"""At photo scale: a smaller deviation never counts as a slip."""

MAX_REPETITIONS = 12

_MIN_REDUNDANCY_NUMBER = 0.05


def cross_positions(crosses: Crosses) -> Array:
    """Return nominal positions ``(2, n)`` in mm."""
    return np.array(list(crosses.values())).T


def sketch_positions(workstation: Workstation, active: Indices, projector: int) -> dict[str, Array]:
    """Return the positions of points on the sketch of a picture ``(2, sessions)``, nan for other sessions."""
    prints = {}
    for name, place in workstation.driver.prints(active, projector).items():
        prints[name] = np.full((2, workstation.operators.size), np.nan)
        prints[name][:, active] = place
    return prints


def locate_plate(
    workstation: Workstation, active: Indices, projector: int, certificate: Camera, times: int
) -> PlatePlacement:
    """Register a mounted plate's fiducials `times` times and return its placement ``(sessions,)``."""
    marks = {fiducial.name: (fiducial.x, fiducial.y) for fiducial in certificate.fiducials}
    registered = [view_fiducials(workstation, active, projector) for _ in range(times)]
    displacements = np.concatenate([seen for _, seen in registered], axis=1)
    every = np.zeros((*displacements.shape[:2], workstation.operators.size))
    every[:, :, active] = displacements
    return plate_placement(every, np.array([marks[name] for names, _ in registered for name in names]).T)


def point_at_crosses(workstation: Workstation, active: Indices, side: int, crosses: Crosses, level: float) -> Array:
    """Point with one eye at crosses at a Z reading; X, Y readings ``(2, n, sessions)``.

    A cross that contradicts the others is struck out and measured again.
    """
    operators = workstation.operators
    names = list(crosses)
    _drive_below_centre(workstation, active, side)
    readings = workstation.point_monocularly(active, side, names, level)
    looking = operators.remaining(active)
    for _ in range(MAX_REPETITIONS):
        misread = (
            _find_misread(readings[:, :, looking], cross_positions(crosses))
            if looking.size
            else np.zeros(0, dtype=np.intp)
        )
        looking, misread = looking[misread >= 0], misread[misread >= 0]
        for index in np.unique(misread):
            again = looking[misread == index]
            why = "does not agree with the other crosses of the plate"
            readings[:, index, again] = workstation.repeat_pointing(again, side, names[index], level, why)[:, again]
        looking = operators.remaining(looking)
    return readings


def _drive_below_centre(workstation: Workstation, active: Indices, side: int) -> None:
    """Drive the mark vertically below a centre, from where all levels are reachable.

    From the side the rods may not be.
    """
    x, y = np.round(workstation.controls.under_centre(active, side), 2)
    workstation.controls.drive(active, {"X": x, "Y": y})


def _find_misread(readings: Array, crosses: Array) -> npt.NDArray[np.intp]:
    """Return the index ``(m,)`` of the cross that contradicts the others, -1 for none.

    The plate is fitted by a projective plane, because a tilted plane is seen in perspective.
    """
    fit = plane_fit(readings, crosses, "projective")
    controlled = fit.adjustment.redundancy_numbers.reshape(fit.residuals.shape)
    off = np.abs(fit.residuals) / np.sqrt(np.maximum(controlled, _MIN_REDUNDANCY_NUMBER))
    sigma = 1.4826 * np.median(off, axis=(0, 1))
    worst = off.max(axis=0)
    suspicious = worst.max(axis=0) > np.maximum(MAX_SLIP_SIGMAS * sigma, MIN_SLIP_MM)
    return np.where(suspicious, worst.argmax(axis=0), -1)
