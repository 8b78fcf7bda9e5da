"""Grid test of a projector with few crosses."""

from a7sim.geometry import GON
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.procedures.grid_test import GridTestPlan, measure_grid_batch
from a7sim.training.attempt_record import ANSWER
from a7sim.training.procedures.base import ProcedureContext, procedure

ANSWERED = ("c", "phi", "omega")


@procedure("grid test")
def grid_test(
    context: ProcedureContext,
    crosses: int = 9,
    levels: int = 2,
    pointings: int = 2,
    sense: float = 1.0,
    in_gon: bool = True,
    projectors: int = 2,
) -> None:
    """Test both projectors with the grid plate and answer the errors of c, phi and omega.

    Mistakes: errors answered with the other `sense`, tilts in radians, or fewer `projectors` tested.
    """
    job = context.workstation.job
    plan = GridTestPlan(job.certificate, job.grid_plate, crosses, levels, pointings, context.model.polarity)
    workstation = Workstation(context.workstation.operators, context.workstation.driver, plan.job)
    for sheet in measure_grid_batch(workstation, plan):
        for name in ANSWERED:
            error = sense * float(sheet.test.errors[name][0])
            answer = error / GON if name != "c" and in_gon else error
            context.person.note(f"{ANSWER}{name}{sheet.projector}={answer:+.4f}")
        if sheet.projector == projectors:
            return
