"""Job sheet of a model, without any truth."""

from a7sim.operator import Job, ModelJob
from a7sim.scenario import Scenario
from a7sim.scene import build_scene
from a7sim.session.lifecycle import make_job
from a7sim.training.handouts.base import Handout, handout

JOB = "job.txt"


@handout("job sheet")
def job_sheet(scenario: Scenario, seed: int, model: str = "1") -> Handout:
    """Return the job sheet of a model."""
    job = make_job(scenario, build_scene(scenario, seed))
    model_job = next(each for each in job.models if each.name == model)
    return Handout({JOB: "\n".join([*_model_lines(job, model_job), *_camera_lines(scenario), *_plan_lines(job), ""])})


def _model_lines(job: Job, model: ModelJob) -> list[str]:
    labels = model.points_of_case(job.plan.case)
    return [
        f"Model {model.name}: {model.left} on the left of the model, {model.right} on its right; {model.polarity}s",
        f"  base {model.base}: {model.left} lies in projector {model.left_projector}, {model.right} in projector "
        f"{model.right_projector}",
        "  points " + ", ".join(f"{label} = {model.standard_points[label]}" for label in labels),
    ]


def _camera_lines(scenario: Scenario) -> list[str]:
    camera = scenario.camera
    x0, y0 = camera.principal_point
    return [
        f"Camera {camera.name}: c = {camera.c:g} mm, principal point x = {x0:+.3f} mm, y = {y0:+.3f} mm",
        "  fiducials " + ", ".join(f"{each.name} ({each.x:+g}, {each.y:+g})" for each in camera.fiducials),
    ]


def _plan_lines(job: Job) -> list[str]:
    plan = job.plan
    x, y, z = plan.preset
    low, high = plan.centre_levels[0], plan.centre_levels[-1]
    return [
        f"Plotter: bx = {plan.bx:g} mm, centres {plan.projection_height:g} mm above the model, height gear "
        f"{plan.height_gear}",
        f"  preset at point 1 on the ground: X = {x:.2f}, Y = {y:.2f}, Z = {z:.2f}",
        f"  perspective centres from Z = {low:.2f} and Z = {high:.2f}",
    ]
