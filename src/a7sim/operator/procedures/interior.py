"""Interior orientation: fiducials to their collimating marks, principal distance to the counter (thesis 3.4.1)."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices
from a7sim.geometry import GON, Array
from a7sim.operator.driving.workstation import Workstation
from a7sim.reduction import PicturePlacement, Undetermined, picture_placement
from a7sim.scenario import Camera

CENTRED_MM = 0.02
"""Tolerance of centring where one is stated (history.md)."""

MISPLACED_MM = 50.0
"""Beyond this displacement a picture is misplaced rather than off centre."""

MAX_ROUNDS = 6


@dataclass(frozen=True)
class InteriorOrientation:
    """Centring of a picture: residuals at the fiducials, and the principal distance set."""

    photograph: str
    rounds: int
    residual_mm: float
    """Rms of the fiducials' displacements without shift, rotation and scale."""
    film_scale: float
    principal_distance: float


@dataclass(frozen=True)
class InteriorOrientationBatch:
    """Interior orientations ``(sessions,)`` of a photograph."""

    photograph: str
    rounds: npt.NDArray[np.intp]
    residual_mm: Array
    film_scale: Array
    principal_distance: Array

    def for_session(self, session: int) -> InteriorOrientation:
        """Return the interior orientation of one session."""
        return InteriorOrientation(
            self.photograph,
            int(self.rounds[session]),
            float(self.residual_mm[session]),
            float(self.film_scale[session]),
            float(self.principal_distance[session]),
        )


def interior_orientation(
    workstation: Workstation, active: Indices, projector: int, photograph: str, certificate: Camera
) -> InteriorOrientationBatch:
    """Mount a photograph in a projector, centre it and set its principal distance.

    Uniform film shrinkage, visible as a change of scale at the fiducials, is included in the principal distance.
    Sessions that cannot centre the picture give up.
    """
    found = centre_picture(workstation, active, projector, photograph, certificate)
    return _set_principal_distance(workstation, workstation.operators.remaining(active), projector, certificate, found)


def centre_picture(
    workstation: Workstation, active: Indices, projector: int, photograph: str, certificate: Camera
) -> InteriorOrientationBatch:
    """Mount a picture in a projector and centre it on the calibrated principal point; no element is changed.

    The principal distances of the result are zero. Sessions that cannot centre the picture give up.
    """
    operators, driver = workstation.operators, workstation.driver
    _mount(workstation, active, projector, photograph)
    marks = {fiducial.name: (fiducial.x, fiducial.y) for fiducial in certificate.fiducials}
    wanted = -np.array(certificate.principal_point)[:, None]
    found = InteriorOrientationBatch(
        photograph, np.zeros(operators.size, dtype=np.intp), *np.zeros((3, operators.size))
    )
    centring = operators.remaining(active)
    for round_ in range(1, MAX_ROUNDS + 1):
        names, displacements = view_fiducials(workstation, centring, projector)
        places = np.array([marks[name] for name in names]).T
        right = _require_near_marks(workstation, centring, projector, photograph, displacements, places)
        centring, displacements = centring[right], displacements[:, :, right]
        try:
            placement = picture_placement(displacements, places)
        except Undetermined as undetermined:
            operators.give_up(centring, f"the fiducials of {photograph} do not tell how it lies: {undetermined}")
            return found
        off = np.array([placement.dx, placement.dy]) - wanted
        is_centred = (np.abs(off).max(axis=0) <= CENTRED_MM) & (
            np.abs(placement.turn) * np.abs(places).max() <= CENTRED_MM
        )
        centred = centring[is_centred]
        found.rounds[centred] = round_
        found.film_scale[centred] = placement.scale[is_centred]
        found.residual_mm[centred] = _rms_residual(displacements, places, placement)[is_centred]
        off, turn, centring = off[:, ~is_centred], placement.turn[~is_centred] / GON, centring[~is_centred]
        if not centring.size:
            break
        now = driver.centring(centring, projector)
        workstation.controls.spend_setting(centring)
        driver.centre(centring, projector, np.round(now - [*off, turn], 3))
        workstation.controls.give_up_on_errors(centring, f"centring {photograph}")
        centring = operators.remaining(centring)
    operators.give_up(centring, f"picture {photograph} cannot be centred in projector {projector}")
    return found


def _mount(workstation: Workstation, active: Indices, projector: int, photograph: str) -> None:
    operators = workstation.operators
    operators.spend(active, operators.observer.seconds_to_mount, "mounting")
    workstation.controls.spend_setting(active)
    workstation.driver.load(active, projector, photograph)
    workstation.controls.give_up_on_errors(active, f"mounting {photograph}")
    loaded_picture = workstation.driver.loaded(active, projector)
    if loaded_picture != photograph:
        operators.give_up(
            active, f"projector {projector} was to hold {photograph}, but {loaded_picture or 'nothing'} lies in it"
        )


def view_fiducials(workstation: Workstation, active: Indices, projector: int) -> tuple[list[str], Array]:
    """Return the names of a picture's fiducials and their displacements ``(2, n, m)`` as registered, mm."""
    names, exact = workstation.driver.fiducials(active, projector)
    operators = workstation.operators
    operators.spend(active, len(names) * operators.observer.seconds_to_read, "reading")
    return names, exact + 1e-3 * operators.draw_setting_errors(active, operators.observer.fiducial_um, exact.shape[:2])[
        :, :, active
    ]


def _require_near_marks(
    workstation: Workstation, active: Indices, projector: int, photograph: str, displacements: Array, places: Array
) -> npt.NDArray[np.bool_]:
    """Return in which sessions the fiducials are near the collimating marks of their names ``(m,)``.

    The other sessions give up.
    """
    furthest = np.abs(displacements).max(axis=(0, 1))
    upside_down = np.abs(displacements + 2.0 * places[:, :, None]).max(axis=(0, 1)) < MISPLACED_MM
    misplaced = furthest > MISPLACED_MM
    for session, distance, turned in zip(active[misplaced], furthest[misplaced], upside_down[misplaced], strict=True):
        how = "upside down" if turned else "beside its marks"
        workstation.operators.give_up(
            np.array([session]),
            f"picture {photograph} lies {how} in projector {projector}: its fiducials stand up to "
            f"{distance:.0f} mm from the collimating marks of their names",
        )
    return np.asarray(~misplaced)


def _rms_residual(displacements: Array, places: Array, placement: PicturePlacement) -> Array:
    x, y = places[:, :, None]
    explained = np.array(
        [
            placement.dx - placement.turn * y + placement.scale * x,
            placement.dy + placement.turn * x + placement.scale * y,
        ]
    )
    return np.asarray(np.sqrt(((displacements - explained) ** 2).mean(axis=(0, 1))))


def _set_principal_distance(
    workstation: Workstation,
    active: Indices,
    projector: int,
    certificate: Camera,
    found: InteriorOrientationBatch,
) -> InteriorOrientationBatch:
    """Set the principal distance at the film scale found; return the orientation with it."""
    c = np.round(certificate.c * (1.0 + found.film_scale[active]), 2)
    workstation.controls.spend_setting(active)
    workstation.driver.set_element(active, f"c{projector}", c)
    workstation.controls.give_up_on_errors(active, f"setting c{projector}")
    workstation.operators.enter(active, "", f"{found.photograph} centred, c{projector}", c)
    principal_distance = np.zeros(workstation.operators.size)
    principal_distance[active] = c
    return replace(found, principal_distance=principal_distance)
