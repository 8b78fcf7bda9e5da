"""What the file of an exercise may say, as frozen data."""

from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, field

from a7sim.scenario.schema import FileRecord

SCHEMA_VERSION = 1

FULL_MARKS = 100.0
"""What the weights of an exercise's criteria add up to."""

OPENING = "opening"
"""The client that says the opening; what it does is nobody's merit."""

Words = Annotated[str, Meta(min_length=1, max_length=4000, description="some words")]
Id = Annotated[
    str, Meta(min_length=1, max_length=40, pattern=r"^[a-z][a-z0-9-]*$", description="a name such as one-sided")
]
Points = Annotated[float, Meta(ge=0, le=FULL_MARKS, description="points, 0 to 100")]


class MetricSpec(FileRecord, frozen=True, kw_only=True):
    """A registered measure with its options."""

    measure: Words
    options: dict[str, Any] = {}


class ChecklistItem(MetricSpec, frozen=True, kw_only=True):
    """A line of the checklist: it ticks itself once a measure of what is seen at the link is as good as `done`."""

    text: Words
    done: float


class Criterion(MetricSpec, frozen=True, kw_only=True):
    """What is graded: a measure, its bands, its weight, and what to tell who does not reach them."""

    id: Id
    title: Words
    excellent: float
    passing: float = field(name="pass")
    weight: Annotated[float, Meta(gt=0, le=FULL_MARKS, description="points above 0 to 100")]
    feedback: Words
    required: bool = True
    """Whether who fails it fails the exercise."""


class Hint(FileRecord, frozen=True, kw_only=True):
    """A hint and what it costs, in points."""

    text: Words
    cost: Points


class PlayedRun(FileRecord, frozen=True, kw_only=True):
    """Something done by a script beside the exercise, or by a procedure of the virtual operator."""

    script: str = ""
    procedure: str = ""
    options: dict[str, Any] = {}
    """Of the procedure."""
    observer: dict[str, Any] = {}
    """Of the virtual operator, such as skill or certain_slips."""
    seed: Annotated[int, Meta(ge=0, description="a whole number, zero or more")] | None = None
    """Of a procedure; a script names its own in its first line."""


class FaultyRun(PlayedRun, frozen=True, kw_only=True):
    """The exercise done with a mistake: which criterion must fail of it, and why."""

    fails: Id
    why: Words


class Exercise(FileRecord, frozen=True, kw_only=True):
    """An exercise."""

    schema_version: Literal[1]
    number: Annotated[int, Meta(ge=1, le=999, description="a number, 1 to 999")]
    title: Words
    goal: Words
    scenario: Words = "akwanga"
    """By name, or a file beside the exercise."""
    settings: dict[str, Any] = {}
    """Values of the scenario by path, instead of its own."""
    vary: dict[str, float] = {}
    """By path, within how much of its own value a number of the scenario is drawn anew by the seed."""
    choose: list[Annotated[list[dict[str, Any]], Meta(min_length=1, description="one alternative or more")]] = []
    """Groups of alternatives, each values by path that belong together; of every group the seed draws one."""
    opening: PlayedRun | None = None
    """What is done at the instrument before the student sits down."""
    handout: str = ""
    """What is put into the student's hands: a registered maker of papers."""
    handout_options: dict[str, Any] = {}
    paper: bool = False
    """Whether it is done on paper alone, without sitting down."""
    model: str = "1"
    """The model of the scenario that it is about."""
    minutes: Annotated[float, Meta(gt=0, le=100000, description="minutes above 0")]
    """Given to it at the simulated clock, as the text says."""
    pass_points: Points = 60.0
    answers: dict[str, Words] = {}
    """What is to be answered on paper: key, and what it is."""
    steps: list[ChecklistItem] = field(default_factory=list, name="step")
    criteria: Annotated[list[Criterion], Meta(min_length=1, description="one criterion or more")] = field(
        name="criterion"
    )
    hints: list[Hint] = field(default_factory=list, name="hint")
    reference: PlayedRun
    faulty: list[FaultyRun] = []

    @property
    def criterion_ids(self) -> list[str]:
        """Return the ids of the criteria in their order."""
        return [each.id for each in self.criteria]


class ExerciseFolder(Struct, frozen=True):
    """An exercise with the folder in which it stands."""

    exercise: Exercise
    folder: Path

    @property
    def name(self) -> str:
        """Return the name of its folder, such as 04-parallax."""
        return self.folder.name

    @property
    def text(self) -> str:
        """Return the exercise in plain words, empty where nobody wrote any."""
        path = self.folder / "text.md"
        return path.read_text(encoding="utf-8") if path.is_file() else ""
