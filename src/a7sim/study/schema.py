"""What a study file may say; every description completes the sentence "expected ..."."""

from typing import Annotated, Any, Literal

from msgspec import Meta

from a7sim.scenario.schema import FileRecord, Name, Text

MAX_REPLICATES = 1_000_000
MAX_CELLS = 2_000

Design = Literal["full", "one-at-a-time", "latin-hypercube"]
Count = Annotated[int, Meta(ge=1, le=MAX_REPLICATES, description="a whole number from 1 to 1000000")]
Settings = dict[str, Any]
"""Values of a scenario by their path, as `--set` names them."""


class Factor(FileRecord, frozen=True, kw_only=True):
    """What a study varies: one value of the scenario, or several together under a name."""

    name: Name
    path: Annotated[str, Meta(min_length=1, description="the path of a scenario value such as plan.case")] | None = None
    """Of the value that `levels` or `range` give."""
    levels: list[Any] = []
    groups: dict[str, Settings] = {}
    """Levels that are several settings each, by name; in place of path and levels."""
    range: tuple[float, float] | None = None
    """Of a number in a Latin hypercube; in place of levels."""


class Precision(FileRecord, frozen=True, kw_only=True):
    """How well the mean of a response has to be known in every cell before a study ends."""

    response: str
    half_width: Annotated[float, Meta(gt=0, description="a number above 0, in the unit of the response")]
    """Of the 95 % interval of its mean."""


class Hypothesis(FileRecord, frozen=True, kw_only=True):
    """What somebody holds to be so, and the cells or responses that tell whether it is.

    `differ`, two groups of levels of a factor that are said to differ; `alike`, levels that are said to give the same;
    or `depends_on`, responses on which others are said to depend.
    """

    says: Annotated[str, Meta(min_length=1, max_length=400, description="a sentence of at most 400 characters")]
    """In words; a page quotes it and answers it."""
    about: Text
    """What is said to matter, as the subject of a sentence: "the number of points"."""
    responses: Annotated[list[str], Meta(min_length=1, description="1 response of the study or more")]
    """On which it is tested."""
    factor: Name | None = None
    differ: Annotated[list[list[str]], Meta(min_length=2, max_length=2, description="two groups of levels")] | None = (
        None
    )
    alike: Annotated[list[str], Meta(min_length=2, description="two levels or more")] | None = None
    depends_on: Annotated[list[str], Meta(min_length=1, description="1 response of the study or more")] | None = None


class StudyDefinition(FileRecord, frozen=True, kw_only=True):
    """A question, the scenario that is asked, and how often."""

    schema_version: Literal[1]
    title: Text
    question: Annotated[str, Meta(min_length=1, description="a question")]
    scenario: Annotated[str, Meta(min_length=1, description="a scenario file, or the name of one")]
    """Beside the study's file, or one that comes with a7sim."""
    settings: Settings = {}
    """Changes to the scenario in every cell."""
    factor: list[Factor] = []
    strips: Literal["all"] | None = None
    """All: every replicate is worked once in every case, and its cells are the strips of all their combinations."""
    design: Design = "full"
    samples: Annotated[int, Meta(ge=2, le=MAX_CELLS, description="2 to 2000 cells")] | None = None
    """Cells of a Latin hypercube."""
    responses: Annotated[list[str], Meta(min_length=1, max_length=100, description="1 to 100 responses")]
    """Names that `study.responses` lists, or paths in a document of results such as models.0.truth.centres.left.Z0."""
    claim: list[Hypothesis] = []
    replicates: Count | None = None
    """In every cell; with a precision to reach, at most so many."""
    precision: Precision | None = None
    seed: Annotated[int, Meta(ge=0, description="a whole number, zero or more")] = 1
