"""Job sheet of a user: the job's title and the camera's certificate."""

from dataclasses import dataclass

import numpy as np

from a7sim.geometry import GON
from a7sim.link.client.client import Client
from a7sim.scenario import Camera

TURNED_MM = 50.0
"""Beyond this displacement a fiducial is misplaced rather than off its collimating mark."""


@dataclass(frozen=True)
class JobSheet:
    """Title and camera certificate; no certificate if only the address of an instrument is known."""

    title: str = ""
    certificate: Camera | None = None


@dataclass(frozen=True)
class CentringResult:
    """Placement of a picture: a description, and the principal distance for its film."""

    words: str
    principal_distance: float | None = None


def centre_picture(client: Client, projector: int, sheet: JobSheet) -> CentringResult:
    """Centre the picture in a projector on its collimating marks by the fiducials, in two rounds.

    Without a certificate the positions of the marks are unknown, and the picture is shifted only.
    """
    lie = CentringResult("")
    for _ in range(2):
        fields = client.fields(f"PHOT{projector}:FID?")
        off = np.array([fields[1::3], fields[2::3]], dtype=float)
        if np.abs(off).max() > TURNED_MM:
            return CentringResult("its fiducials stand far from their marks: wrong camera, or upside down")
        now = client.numbers(f"PHOT{projector}:CENT?")
        lie, shift = _lie(fields[0::3], off, sheet.certificate)
        client.send(f"PHOT{projector}:CENT " + ",".join(f"{a - b:.3f}" for a, b in zip(now, shift, strict=True)))
    return lie


def _lie(
    names: list[str], off: np.ndarray[tuple[int, ...], np.dtype[np.float64]], certificate: Camera | None
) -> tuple[CentringResult, tuple[float, float, float]]:
    from a7sim.reduction import Undetermined, picture_placement  # noqa: PLC0415 # not before the screen is there

    marks = {each.name: (each.x, each.y) for each in certificate.fiducials} if certificate else {}
    if certificate is None or not set(names) <= set(marks):
        dx, dy = off.mean(axis=1)
        return CentringResult(f"centred by its {len(names)} fiducials, without a certificate"), (
            float(dx),
            float(dy),
            0.0,
        )
    try:
        lie = picture_placement(off, np.array([marks[name] for name in names]).T)
    except Undetermined:
        return CentringResult("too few fiducials to centre it by"), (0.0, 0.0, 0.0)
    x, y = certificate.principal_point
    c = round(certificate.c * (1.0 + float(lie.scale)), 2)
    summary = f"centred by its {len(names)} fiducials; with the film's shrinkage c is {c:.2f}"
    return CentringResult(summary, c), (float(lie.dx) + x, float(lie.dy) + y, float(lie.turn) / GON)
