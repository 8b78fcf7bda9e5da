"""The twenty-five strips of the thesis: each case of one model with each case of the next (thesis 4.3)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import msgspec

from a7sim.errors import A7SimError
from a7sim.journal.session_files import RESULTS, STRIPS, write_atomic
from a7sim.journal.writer import make_header, write_header_only
from a7sim.operator import ModelJob
from a7sim.reduction import Ground, Model, Undetermined
from a7sim.result_documents import Document, as_json
from a7sim.scenario import Scenario, amend_provenance
from a7sim.scenario.schema import StripPlan
from a7sim.scene import build_scene
from a7sim.session.lifecycle import RunOptions, make_job
from a7sim.session.result_records import SessionResult
from a7sim.session.results import results_header, strips_csv
from a7sim.session.running import measure_session
from a7sim.standard_points import CASES
from a7sim.strip_methods.strip import ground_control, orient_strip, oriented_strip_document

MAX_STRIPS = 700
"""Strips of one command: five cases in up to four models."""

FOLDER_OF_CASE = "case-{}"


@dataclass(frozen=True)
class Combination:
    """Strip of models each oriented on the points of a case of its own, numbered as in the thesis."""

    number: int
    cases: tuple[str, ...]
    models: tuple[Model, ...]


def run_combinations(scenario: Scenario, seed: int, options: RunOptions | None = None) -> Document:
    """Run a scenario in each case and return the document of all strips that the models form.

    The sessions are those of `run` for each case; with a folder, each has a subfolder. The first session that does not
    fit ends the run. Raises A7SimError for a scenario without ground control or with too many models.
    """
    options = options or RunOptions()
    check_strips_possible(scenario)
    options.prepare_folder(tuple(map(FOLDER_OF_CASE.format, CASES)))
    if options.folder is not None and not options.journal_options.resumes:
        write_header_only(options.folder, make_header("run", scenario, seed, strips="all"))
    document = results_header(scenario, seed) | {"case": "all", "status": "complete", "message": ""}
    sessions: dict[str, SessionResult] = {}
    for case in CASES:
        session = measure_session(with_case(scenario, case), seed, options.for_part(FOLDER_OF_CASE.format(case)))
        sessions[case] = session
        if session.status != "complete":
            document |= {"status": session.status, "message": f"case {case}: {session.message}"}
            break
    document["sessions"] = {case: each.operator for case, each in sessions.items()}
    document["strips"] = _strips(scenario, seed, sessions) if document["status"] == "complete" else []
    if options.folder is not None:
        write_atomic(options.folder / STRIPS, strips_csv(document["strips"]))
        write_atomic(options.folder / RESULTS, as_json(document))
    return document


def with_case(scenario: Scenario, case: str) -> Scenario:
    """Return a scenario whose models are all oriented on the points of a case."""
    scenario_of_case = msgspec.structs.replace(scenario, plotting=msgspec.structs.replace(scenario.plan, case=case))
    return amend_provenance(scenario_of_case, "--strips all", f"--case {case}", {"plan.case": f'"{case}"'})


def check_strips_possible(scenario: Scenario) -> None:
    """Raise A7SimError for a scenario with too many models or without ground control."""
    strips = len(CASES) ** len(scenario.models)
    if strips > MAX_STRIPS:
        raise A7SimError(
            f"--strips all: expected at most {MAX_STRIPS} strips, got {len(scenario.models)} models: {strips}"
        )
    if not any(point.role != "check" for point in scenario.ground):
        raise A7SimError("--strips all: expected ground control in the scenario, got none")


def _strips(scenario: Scenario, seed: int, sessions: Mapping[str, SessionResult]) -> list[Document]:
    scene = build_scene(scenario, seed)
    ground, jobs = ground_control(scenario, scene), make_job(scenario, scene).models
    by_case = {case: session.strip_models for case, session in sessions.items()}
    return [_combination_document(each, jobs, ground, scenario.strip) for each in combinations(by_case)]


def combinations(by_case: Mapping[str, Sequence[Model]]) -> Iterator[Combination]:
    """Yield each combination of the models' cases: A with A first, E with E last."""
    models = len(next(iter(by_case.values())))
    for number, cases in enumerate(product(by_case, repeat=models), start=1):
        yield Combination(number, cases, tuple(by_case[case][i] for i, case in enumerate(cases)))


def _combination_document(
    combination: Combination, jobs: Sequence[ModelJob], ground: Ground, plan: StripPlan
) -> Document:
    description = {
        "number": combination.number,
        "cases": list(combination.cases),
        "in_words": describe(combination, jobs),
    }
    try:
        return description | oriented_strip_document(
            orient_strip(combination.models, ground, plan.join, plan.polynomial)
        )
    except Undetermined as undetermined:
        raise A7SimError(f"strip {combination.number}: {undetermined}") from undetermined


def describe(combination: Combination, jobs: Sequence[ModelJob]) -> str:
    """Return the diagram of a strip (thesis fig. 4.3) as text."""
    parts = [
        f"model {job.name} ({job.left} and {job.right}) case {case}, oriented on {' '.join(job.points_of_case(case))}"
        for job, case in zip(jobs, combination.cases, strict=True)
    ]
    joins = [
        f"models {before.name} and {after.name} joined on {' '.join(sorted(set(before.points) & set(after.points)))}"
        for before, after in pairwise(combination.models)
    ]
    return f"Strip {combination.number}: " + "; ".join([*parts, *joins])
