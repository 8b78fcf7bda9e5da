"""Computation forms for an orientation by hand."""

from a7sim.scenario import Scenario
from a7sim.training.forms import computation_form
from a7sim.training.handouts.base import Handout, handout


@handout("orientation forms")
def orientation_forms(scenario: Scenario, seed: int, cases: str = "AE") -> Handout:
    """Return a computation form for each case."""
    return Handout({f"form-{case}.txt": computation_form(scenario, case) for case in cases})
