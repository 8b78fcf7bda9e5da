"""Loading of studies: all errors of a study file are reported before any session runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec

import a7sim
from a7sim.bundled import bundled_dirs
from a7sim.errors import A7SimError
from a7sim.scenario import Scenario, ScenarioError, load_scenario
from a7sim.scenario.validation import schema_errors
from a7sim.session.strip_combinations import check_strips_possible
from a7sim.study.cells import Cell, make_cells, make_strip_cells
from a7sim.study.claims import validate_claims
from a7sim.study.responses import Response, find_response
from a7sim.study.schema import StudyDefinition
from a7sim.study.setting_limits import settings_out_of_range
from a7sim.study.simulating import Task
from a7sim.table_files import describe_missing_file, read_toml

SEARCH_PATH = bundled_dirs("studies")
"""Folders of the studies that come with a7sim."""


class StudyError(A7SimError):
    """Invalid study; each line states one error and its place."""

    def __init__(self, source: str, mistakes: Sequence[str]) -> None:
        super().__init__("\n".join(f"{source}: {mistake}" for mistake in mistakes))


@dataclass(frozen=True)
class LoadedStudy:
    """Study with its cells, their scenarios and its responses, ready to run.

    One scenario gives the numbers of one cell, or of as many consecutive cells as its `Task` states.
    """

    study: StudyDefinition
    cells: tuple[Cell, ...]
    scenarios: tuple[Scenario, ...]
    responses: tuple[Response, ...]
    source: str

    @property
    def replicates(self) -> int:
        """Maximum number of replicates per cell."""
        if self.study.replicates is None:
            raise StudyError(self.source, ["replicates: expected how often each cell is worked, got nothing"])
        return self.study.replicates

    @cached_property
    def tasks(self) -> tuple[Task, ...]:
        """Tasks for the workers: one per scenario, in the order of the cells."""
        responses = tuple(self.study.responses)
        return tuple(Task(each, responses, self.study.strips is not None) for each in self.scenarios)

    def task_of(self, cell: int) -> tuple[Task, int]:
        """Return the task of a cell, counted from 0, and the index of the cell within that task."""
        task, place = divmod(cell, self.tasks[0].cells)
        return self.tasks[task], place

    @property
    def factors(self) -> dict[str, list[str]]:
        """Levels by factor, in the order of the cells."""
        return {name: list(dict.fromkeys(cell.levels[name] for cell in self.cells)) for name in self.cells[0].levels}

    @property
    def identity(self) -> str:
        """Hash of all that determines a replicate; titles and the number of replicates do not change it."""
        asked = msgspec.structs.replace(
            self.study, title="study", question="", claim=[], replicates=None, precision=None
        )
        return sha256(msgspec.json.encode([a7sim.__version__, asked, self.scenarios])).hexdigest()


def find_study(name: str | Path) -> Path:
    """Return the path of a study file, given as a path or as the name of a study that comes with a7sim.

    Raises StudyError.
    """
    path = Path(name)
    if path.is_file():
        return path
    for shelf in SEARCH_PATH:
        found = shelf / f"{path.name.removesuffix('.toml')}.toml"
        if path.parent in (Path(), Path("studies")) and found.is_file():
            return found
    known = ", ".join(sorted({file.stem for shelf in SEARCH_PATH for file in shelf.glob("*.toml")}))
    raise StudyError(
        str(name)[:200], [f"expected the file of a study or one of {known}, found {describe_missing_file(path)}"]
    )


def load_study(name: str | Path, replicates: int | None = None) -> LoadedStudy:
    """Return a study ready to run, with another number of replicates if given. Raises A7SimError."""
    path = find_study(name)
    raw = read_toml(path)
    if replicates is not None:
        raw["replicates"] = replicates
    return build_study(raw, path.parent, str(path))


def build_study(raw: Mapping[str, Any], folder: Path, source: str = "study") -> LoadedStudy:
    """Return the study of raw tables; its scenario is in `folder` or comes with a7sim. Raises StudyError."""
    if "scenario" not in raw and "photos" in raw:
        raise StudyError(source, ["expected a study, got a scenario (`a7sim run` takes it)"])
    mistakes = [error.replace("the scenario", "the study") for error in schema_errors(raw, _expected())]
    if mistakes:
        raise StudyError(source, mistakes)
    study = msgspec.convert(raw, StudyDefinition)
    try:
        cells, responses = make_cells(study), [find_response(name) for name in study.responses]
    except A7SimError as error:
        raise StudyError(source, [str(error)]) from error
    mistakes = list(_mistakes_between(study))
    if mistakes:
        raise StudyError(source, mistakes)
    scenarios = _scenarios(study, cells, folder, source)
    try:
        if study.strips is not None:
            cells = make_strip_cells(cells, _models_of_strips(study, scenarios))
        validate_claims(study, cells)
    except A7SimError as error:
        raise StudyError(source, [str(error)]) from error
    return LoadedStudy(study, tuple(cells), scenarios, tuple(responses), source)


def _mistakes_between(study: StudyDefinition) -> list[str]:
    mistakes = []
    names = [factor.name for factor in study.factor]
    if len(set(names)) < len(names):
        mistakes.append(f"factor: expected every name once, got {', '.join(names)}")
    if len(set(study.responses)) < len(study.responses):
        mistakes.append("responses: expected every response once")
    if study.replicates is None:
        mistakes.append("replicates: expected how often each cell is worked (1 to 1000000), got nothing")
    if study.precision is not None and study.precision.response not in study.responses:
        known = ", ".join(study.responses)
        mistakes.append(f"precision.response: expected one of {known}, got {study.precision.response!r}")
    return mistakes


def _models_of_strips(study: StudyDefinition, scenarios: Sequence[Scenario]) -> list[str]:
    """Return the names of the models whose cases are combined. Raises A7SimError if they cannot be combined."""
    paths = [*study.settings, *(path for cell in make_cells(study) for path in cell.settings)]
    if "plan.case" in paths or study.design != "full":
        raise A7SimError("strips = 'all': expected a full design without plan.case, since every case is worked")
    names = {tuple(model.name for model in scenario.models) for scenario in scenarios}
    if len(names) != 1 or any(scenario.work != ["plotter"] for scenario in scenarios):
        raise A7SimError("strips = 'all': expected the same models in every cell and work at the plotter alone")
    for scenario in scenarios:
        check_strips_possible(scenario)
    return list(names.pop())


def _scenarios(study: StudyDefinition, cells: Sequence[Cell], folder: Path, source: str) -> tuple[Scenario, ...]:
    """Return the scenario of each cell. Raises StudyError with the errors of the first invalid cell."""
    beside = folder / study.scenario
    name = beside if beside.is_file() else study.scenario
    scenarios = []
    for cell in cells:
        where = f"cell {cell.number} ({cell.label})"
        try:
            scenario = load_scenario(name, settings=cell.settings)
        except ScenarioError as error:
            raise StudyError(source, [f"{where}: {mistake}" for mistake in error.mistakes]) from error
        beyond = [f"{where}: {mistake}" for mistake in settings_out_of_range(scenario)]
        if beyond:
            raise StudyError(source, beyond)
        scenarios.append(scenario)
    return tuple(scenarios)


@cache
def _expected() -> msgspec.inspect.Type:
    return msgspec.inspect.type_info(StudyDefinition)
