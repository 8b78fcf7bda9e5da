"""List of ground control for the operator."""

import math

from a7sim.reduction import Ground
from a7sim.scenario import Scenario
from a7sim.scene import build_scene
from a7sim.strip_methods.strip import given_control
from a7sim.table_files import to_csv
from a7sim.training.handouts.base import Handout, handout

COLUMNS = ("point", "X", "Y", "Z", "role")


@handout("control")
def control(scenario: Scenario, seed: int, points: list[str] | None = None) -> Handout:
    """Return the list of ground control, of the named points or of all."""
    return Handout({"control.csv": control_csv(given_control(scenario, build_scene(scenario, seed)), points)})


def control_csv(ground: Ground, points: list[str] | None = None) -> str:
    """Return ground control as CSV, m; empty where a coordinate is not given."""
    positions = zip(ground.points, ground.coordinates.T.tolist(), ground.roles, strict=True)
    rows = [
        (name, *("" if math.isnan(each) else f"{each:.2f}" for each in position), role)
        for name, position, role in positions
        if points is None or name in points
    ]
    return to_csv(COLUMNS, rows)
