"""Interior orientation: fiducials to their collimating marks, principal distance to the counter (thesis 3.4.1)."""

from dataclasses import dataclass

import numpy as np

from a7sim.geometry import GON, Array
from a7sim.operator.person import Person
from a7sim.reduction import PictureLie, Undetermined, picture_lie
from a7sim.scenario import Camera

CENTRED_MM = 0.02
"""How well pictures are centred where a tolerance is stated (history.md)."""

MISPLACED_MM = 50.0
"""Beyond this a fiducial is not off its collimating mark, it is somewhere else."""

MOST_ROUNDS = 6


@dataclass(frozen=True)
class InteriorOrientation:
    """How a picture was centred: what was left at the fiducials, and the principal distance set."""

    photograph: str
    rounds: int
    residual_mm: float
    """Rms of the fiducials' displacements that no shift, turn or scale explains."""
    film_scale: float
    principal_distance: float


def interior_orientation(person: Person, projector: int, photograph: str, certificate: Camera) -> InteriorOrientation:
    """Mount a photograph in a projector and centre it on the calibrated principal point.

    Uniform film shrinkage, seen as a change of scale at the fiducials, goes into the principal distance.
    Raises DoesNotFit when the picture cannot be centred.
    """
    client = person.client
    person.clock.spend(person.observer.seconds_to_mount)
    person.set(f'PHOT{projector}:LOAD "{photograph}"')
    (lies_there,) = client.fields(f"PHOT{projector}?")
    if lies_there != photograph:
        raise person.give_up(
            f"projector {projector} was to hold {photograph}, but {lies_there or 'nothing'} lies in it"
        )
    marks = {fiducial.name: (fiducial.x, fiducial.y) for fiducial in certificate.fiducials}
    for round_ in range(1, MOST_ROUNDS + 1):
        names, displacements = _fiducials_seen(person, projector)
        places = np.array([marks[name] for name in names]).T
        if np.abs(displacements).max() > MISPLACED_MM:
            how = "upside down" if np.abs(displacements + 2.0 * places).max() < MISPLACED_MM else "beside its marks"
            raise person.give_up(
                f"picture {photograph} lies {how} in projector {projector}: its fiducials stand up to "
                f"{np.abs(displacements).max():.0f} mm from the collimating marks of their names"
            )
        try:
            lie = picture_lie(displacements, places)
        except Undetermined as undetermined:
            raise person.give_up(f"the fiducials of {photograph} do not tell how it lies: {undetermined}") from None
        wanted = -np.array(certificate.principal_point)
        off = np.array([lie.dx - wanted[0], lie.dy - wanted[1]])
        if np.abs(off).max() <= CENTRED_MM and abs(lie.turn) * np.abs(places).max() <= CENTRED_MM:
            return _set_principal_distance(
                person, projector, photograph, certificate, round_, lie, displacements, places
            )
        now = client.numbers(f"PHOT{projector}:CENT?")
        turn = lie.turn / GON
        person.set(
            f"PHOT{projector}:CENT {now[0] - off[0]:.3f},{now[1] - off[1]:.3f},{now[2] - turn:.3f}",
        )
    raise person.give_up(f"picture {photograph} cannot be centred in projector {projector}")


def _fiducials_seen(person: Person, projector: int) -> tuple[list[str], Array]:
    fields = person.client.fields(f"PHOT{projector}:FID?")
    person.clock.spend(len(fields) / 3 * person.observer.seconds_to_read)
    names = fields[0::3]
    exact = np.array([fields[1::3], fields[2::3]], dtype=float)
    return names, exact + 1e-3 * person.errors(person.observer.fiducial_um, exact.shape)


def _set_principal_distance(
    person: Person,
    projector: int,
    photograph: str,
    certificate: Camera,
    rounds: int,
    lie: PictureLie,
    displacements: Array,
    places: Array,
) -> InteriorOrientation:
    explained = np.array(
        [
            lie.dx - lie.turn * places[1] + lie.scale * places[0],
            lie.dy + lie.turn * places[0] + lie.scale * places[1],
        ]
    )
    residual = float(np.sqrt(((displacements - explained) ** 2).mean()))
    c = round(certificate.c * (1.0 + lie.scale), 2)
    person.set(f"PROJ{projector}:PDIS {c:.2f}")
    person.book.enter(person.clock.now, "", f"{photograph} centred, c{projector}", f"{c:.2f}")
    return InteriorOrientation(photograph, rounds, residual, lie.scale, c)
