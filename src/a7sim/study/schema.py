"""Contents of a study file; each description completes the sentence "expected ..."."""

from typing import Annotated, Any, Literal

from msgspec import Meta

from a7sim.scenario.schema import FileRecord, Name, Text

MAX_REPLICATES = 1_000_000
MAX_CELLS = 2_000

Design = Literal["full", "one-at-a-time", "latin-hypercube"]
Count = Annotated[int, Meta(ge=1, le=MAX_REPLICATES, description="a whole number from 1 to 1000000")]
Settings = dict[str, Any]
"""Values of a scenario by their path, as in `--set`."""


class Factor(FileRecord, frozen=True, kw_only=True):
    """Factor of a study: one value of the scenario, or several values together under a name."""

    name: Name
    path: Annotated[str, Meta(min_length=1, description="the path of a scenario value such as plan.case")] | None = None
    """Scenario value that `levels` or `range` vary."""
    levels: list[Any] = []
    groups: dict[str, Settings] = {}
    """Levels of several settings each, by name; instead of path and levels."""
    range: tuple[float, float] | None = None
    """Range of a number in a Latin hypercube; instead of levels."""


class Precision(FileRecord, frozen=True, kw_only=True):
    """Precision of the mean of a response in each cell at which a study ends."""

    response: str
    half_width: Annotated[float, Meta(gt=0, description="a number above 0, in the unit of the response")]
    """Half width of the 95 % interval of the mean."""


class Hypothesis(FileRecord, frozen=True, kw_only=True):
    """Hypothesis with the cells or responses that test it.

    `differ`: two groups of levels of a factor that differ; `alike`: levels that give equal results; `depends_on`:
    responses on which other responses depend.
    """

    says: Annotated[str, Meta(min_length=1, max_length=400, description="a sentence of at most 400 characters")]
    """Hypothesis as a sentence; the page quotes it and answers it."""
    about: Text
    """Factor in question, as the subject of a sentence: "the number of points"."""
    responses: Annotated[list[str], Meta(min_length=1, description="1 response of the study or more")]
    """Responses on which it is tested."""
    factor: Name | None = None
    differ: Annotated[list[list[str]], Meta(min_length=2, max_length=2, description="two groups of levels")] | None = (
        None
    )
    alike: Annotated[list[str], Meta(min_length=2, description="two levels or more")] | None = None
    depends_on: Annotated[list[str], Meta(min_length=1, description="1 response of the study or more")] | None = None


class StudyDefinition(FileRecord, frozen=True, kw_only=True):
    """Question, scenario, design and number of replicates."""

    schema_version: Literal[1]
    title: Text
    question: Annotated[str, Meta(min_length=1, description="a question")]
    scenario: Annotated[str, Meta(min_length=1, description="a scenario file, or the name of one")]
    """File beside the study file, or name of a scenario that comes with a7sim."""
    settings: Settings = {}
    """Changes to the scenario in all cells."""
    factor: list[Factor] = []
    strips: Literal["all"] | None = None
    """`all`: each replicate is run once in each case, and the cells are the strips of all combinations of cases."""
    design: Design = "full"
    samples: Annotated[int, Meta(ge=2, le=MAX_CELLS, description="2 to 2000 cells")] | None = None
    """Number of cells of a Latin hypercube."""
    responses: Annotated[list[str], Meta(min_length=1, max_length=100, description="1 to 100 responses")]
    """Names of `study.responses`, or paths in the results such as models.0.truth.centres.left.Z0."""
    claim: list[Hypothesis] = []
    replicates: Count | None = None
    """Replicates per cell; the maximum if a precision is required."""
    precision: Precision | None = None
    seed: Annotated[int, Meta(ge=0, description="a whole number, zero or more")] = 1
