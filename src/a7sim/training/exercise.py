"""Contents of an exercise file as frozen records."""

from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, field

from a7sim.scenario.schema import FileRecord

SCHEMA_VERSION = 1

FULL_MARKS = 100.0
"""Sum of the weights of an exercise's criteria."""

OPENING = "opening"
"""Client of the opening; its actions are not graded."""

Words = Annotated[str, Meta(min_length=1, max_length=4000, description="some words")]
Id = Annotated[
    str, Meta(min_length=1, max_length=40, pattern=r"^[a-z][a-z0-9-]*$", description="a name such as one-sided")
]
Points = Annotated[float, Meta(ge=0, le=FULL_MARKS, description="points, 0 to 100")]


class MetricSpec(FileRecord, frozen=True, kw_only=True):
    """Registered metric with its options."""

    measure: Words
    options: dict[str, Any] = {}


class ChecklistItem(MetricSpec, frozen=True, kw_only=True):
    """Item of the checklist: it is ticked once a metric of the events at the link reaches `done`."""

    text: Words
    done: float


class Criterion(MetricSpec, frozen=True, kw_only=True):
    """Criterion of the grade: a metric, its bands, its weight, and the advice for failing it."""

    id: Id
    title: Words
    excellent: float
    passing: float = field(name="pass")
    weight: Annotated[float, Meta(gt=0, le=FULL_MARKS, description="points above 0 to 100")]
    feedback: Words
    required: bool = True
    """Whether the exercise fails if this criterion fails."""


class Hint(FileRecord, frozen=True, kw_only=True):
    """Hint and its cost in points."""

    text: Words
    cost: Points


class PlayedRun(FileRecord, frozen=True, kw_only=True):
    """Run by a script beside the exercise, or by a procedure of the virtual operator."""

    script: str = ""
    procedure: str = ""
    options: dict[str, Any] = {}
    """Of the procedure."""
    observer: dict[str, Any] = {}
    """Of the virtual operator, such as skill or certain_slips."""
    seed: Annotated[int, Meta(ge=0, description="a whole number, zero or more")] | None = None
    """Of a procedure; a script names its own in its first line."""


class FaultyRun(PlayedRun, frozen=True, kw_only=True):
    """Run with a mistake: the criterion that must fail, and the reason."""

    fails: Id
    why: Words


class Exercise(FileRecord, frozen=True, kw_only=True):
    """Exercise."""

    schema_version: Literal[1]
    number: Annotated[int, Meta(ge=1, le=999, description="a number, 1 to 999")]
    title: Words
    goal: Words
    scenario: Words = "akwanga"
    """By name, or a file beside the exercise."""
    settings: dict[str, Any] = {}
    """Values of the scenario by path."""
    vary: dict[str, float] = {}
    """By path, the share of its value within which the seed draws a number of the scenario anew."""
    choose: list[Annotated[list[dict[str, Any]], Meta(min_length=1, description="one alternative or more")]] = []
    """Groups of alternatives, each a set of values by path; the seed draws one alternative of each group."""
    opening: PlayedRun | None = None
    """Actions at the instrument before the student starts."""
    handout: str = ""
    """Registered maker of the handouts of the student."""
    handout_options: dict[str, Any] = {}
    paper: bool = False
    """Whether the exercise needs no instrument."""
    model: str = "1"
    """Model of the scenario that it uses."""
    minutes: Annotated[float, Meta(gt=0, le=100000, description="minutes above 0")]
    """Time limit on the simulated clock, as stated in the text."""
    pass_points: Points = 60.0
    answers: dict[str, Words] = {}
    """Answers to be given on paper: key, and description."""
    steps: list[ChecklistItem] = field(default_factory=list, name="step")
    criteria: Annotated[list[Criterion], Meta(min_length=1, description="one criterion or more")] = field(
        name="criterion"
    )
    hints: list[Hint] = field(default_factory=list, name="hint")
    reference: PlayedRun
    faulty: list[FaultyRun] = []

    @property
    def criterion_ids(self) -> list[str]:
        """Return the ids of the criteria in order."""
        return [each.id for each in self.criteria]


class ExerciseFolder(Struct, frozen=True):
    """Exercise with its folder."""

    exercise: Exercise
    folder: Path

    @property
    def name(self) -> str:
        """Name of its folder, such as 04-parallax."""
        return self.folder.name

    @property
    def text(self) -> str:
        """Text of the exercise, empty if there is none."""
        path = self.folder / "text.md"
        return path.read_text(encoding="utf-8") if path.is_file() else ""
