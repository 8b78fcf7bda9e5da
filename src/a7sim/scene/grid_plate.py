"""Grid plate: a photograph whose points are crosses."""

import numpy as np

from a7sim.scenario.schema import Camera, GridPlate
from a7sim.scene.camera import fiducial_places
from a7sim.scene.content import marks_image
from a7sim.scene.photograph import NamedPoints, Photograph, prick_points

GRID_PLATE_STREAM = 6
"""Spawn key of a plate's random numbers, under the seed of the plate."""


def grid_plate(plate: GridPlate, camera: Camera, polarity: str) -> Photograph:
    """Return a grid plate that fits the collimating marks of a camera's pictures, with their polarity.

    Crosses and fiducial marks deviate from their nominal positions by the accuracy of the plate.
    """
    rng = np.random.default_rng(np.random.SeedSequence(plate.seed, spawn_key=(GRID_PLATE_STREAM,)))
    certificate = plate.certificate(camera)
    names, nominal = fiducial_places(certificate)
    crosses = plate.crosses
    ruled = np.array(list(crosses.values())).T
    sigma = 1e-3 * plate.accuracy_um
    points = NamedPoints(tuple(crosses), ruled + sigma * rng.standard_normal(ruled.shape))
    fiducials = NamedPoints(names, nominal + sigma * rng.standard_normal(nominal.shape))
    return Photograph(
        plate.name,
        certificate,
        fiducials,
        points,
        prick_points(points, rng),
        polarity,
        content=marks_image(points),
    )
