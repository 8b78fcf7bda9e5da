"""Procedures of the virtual operator for references, openings and the skill study, by name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from a7sim.errors import A7SimError
from a7sim.link.client.client import Client
from a7sim.link.headers import quote_text, registration_word
from a7sim.link.inprocess import InProcessSerial
from a7sim.operator import Job, ModelJob, OperatorGaveUp, Person, measure_models
from a7sim.operator.driving.scpi_driver import ScpiDriver
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.people.observation_book import BookEntry
from a7sim.operator.people.operator_batch import OperatorBatch
from a7sim.operator.procedures.models import load_prints, mount_photographs, orient_model, set_base_and_fittings
from a7sim.plotters import VARIANTS
from a7sim.reduction import Undetermined
from a7sim.session.lifecycle import make_job
from a7sim.training.attempt_record import ANSWER
from a7sim.training.environment import AttemptEnvironment
from a7sim.training.exercise import PlayedRun
from a7sim.training.variation import scenario_for

ELEMENTS = frozenset(name for variant in VARIANTS.values() for name in variant.elements)

_POINTING_ITEMS = {1: "X left at", 2: "X right at"}
"""Start of items of monocular pointings, by the side of the photograph."""

_REGISTERED_ITEMS = (*_POINTING_ITEMS.values(), "parallax seen")
"""Items at which counters are registered beside those of elements."""


@dataclass(frozen=True)
class ProcedureContext:
    """Virtual operator at the instrument of an exercise."""

    person: Person
    workstation: Workstation
    model: ModelJob
    papers: Mapping[str, str] = field(default_factory=dict)
    """Handouts by file name."""

    @classmethod
    def for_model(cls, person: Person, job: Job, model: str) -> "ProcedureContext":
        """Return an operator for a model of a job."""
        workstation = Workstation(OperatorBatch.single(person), ScpiDriver(person), job)
        return cls(person, workstation, next(each for each in job.models if each.name == model))

    def points(self) -> list[str]:
        """Return the names of the standard points on the job sheet."""
        labels = self.model.points_of_case(self.workstation.job.plan.case)
        return [self.model.standard_points[label] for label in labels]

    def set_up(self) -> None:
        """Set the instrument as on the job sheet, mount and centre pictures, load the prints."""
        workstation = self.workstation
        active = workstation.operators.active
        self.begin("preparation")
        workstation.controls.prepare(active)
        self.begin("interior orientation")
        set_base_and_fittings(workstation, self.model.base, self.model.polarity)
        mount_photographs(workstation, self.model)
        workstation.begin(active, self.model, load_prints(workstation, self.model))

    def take_over(self) -> None:
        """Take over a prepared instrument: base and pictures set, its counters as after `*RST`."""
        active = self.workstation.operators.active
        self.workstation.controls.take_over(active)
        self.workstation.controls.counters(active)
        self.workstation.begin(active, self.model, load_prints(self.workstation, self.model))

    def answer(self, answers: Mapping[str, float], decimals: int = 2) -> None:
        """Write answers as notes at the instrument."""
        for key, value in answers.items():
            self.person.note(f"{ANSWER}{key}={value:.{decimals}f}")

    def begin(self, form: str) -> None:
        """Start a form of the book."""
        self.workstation.operators.begin(self.workstation.operators.active, self.model.name, form)
        self.person.note(f"{self.model.name}: {form}")


def perturb_elements(context: ProcedureContext, elements: Mapping[str, float]) -> None:
    """Turn elements by amounts, as a mistake."""
    active = context.workstation.operators.active
    readings = context.workstation.controls.elements(active, list(elements))
    context.workstation.controls.turn_elements(
        active, {name: readings[name] + amount for name, amount in elements.items()}
    )


def misplace_fittings(context: ProcedureContext, fittings: Mapping[str, str]) -> None:
    """Set fittings to positions, as a mistake."""
    for name, position in fittings.items():
        context.workstation.driver.set_fitting(np.asarray(context.workstation.operators.active), name, position)


Procedure = Callable[..., None]
"""Function of `ProcedureContext` and the options of an exercise."""

PROCEDURES: dict[str, Procedure] = {}
"""All procedures by the names in exercises."""


def procedure(name: str) -> Callable[[Procedure], Procedure]:
    """Register a procedure under a name."""

    def register(function: Procedure) -> Procedure:
        PROCEDURES[name] = function
        return function

    return register


def run_procedure(
    environment: AttemptEnvironment, played: PlayedRun, client: str, papers: Mapping[str, str] | None = None
) -> str:
    """Run a procedure of the virtual operator; return the reason if the operator gave up. Raises A7SimError.

    `papers` are the handouts by file name.
    """
    port = InProcessSerial(instrument=environment.instrument, clock=environment.clock, client=client, timeout=1.0)
    observer = scenario_for(environment.exercise_folder, environment.seed, played.observer).observer
    person = Person(Client(port), environment.clock, observer, environment.seed)
    context = ProcedureContext.for_model(
        person, make_job(environment.scenario, environment.scene), environment.exercise_folder.exercise.model
    )
    person.book.listener = _RegistrationButton(person.client, context.model).on_entry
    try:
        PROCEDURES[played.procedure](replace(context, papers=papers or {}), **played.options)
    except (OperatorGaveUp, Undetermined) as error:
        return str(error) or type(error).__name__
    except TypeError as error:
        if "argument" not in str(error):
            raise
        raise A7SimError(f"{played.procedure}: expected the options of this procedure: {error}") from error
    finally:
        port.close()
    return ""


REGISTERED_BEFORE_ENTRY = "X"
"""Items of a stereoscopic point: all three coordinates are registered before they are entered."""


class _RegistrationButton:
    """Button of the recording device: entries of the book are registered as well.

    With the element that is read; a monocular pointing with by of its projector, which identifies it.
    """

    def __init__(self, client: Client, model: ModelJob) -> None:
        self._client = client
        self._numbers: dict[int, int] = {}
        self._pointing_elements = {
            _POINTING_ITEMS[1]: f"by{model.left_projector}",
            _POINTING_ITEMS[2]: f"by{model.right_projector}",
        }

    def on_entry(self, entry: BookEntry) -> None:
        if entry.struck:
            if entry.number in self._numbers:
                self._client.send(f"REC:STR {self._numbers[entry.number]},{quote_text(entry.struck[:60])}")
        elif entry.point and (
            entry.item in {REGISTERED_BEFORE_ENTRY, *ELEMENTS} or entry.item.startswith(_REGISTERED_ITEMS)
        ):
            if entry.item != REGISTERED_BEFORE_ENTRY:
                self._client.send(",".join([f"REC {quote_text(entry.point)}", *self._words(entry.item)]))
            self._numbers[entry.number] = int(self._client.numbers("REC:COUN?")[0])

    def _words(self, item: str) -> list[str]:
        """Return the elements that are registered with an item of the book."""
        if item in ELEMENTS:
            return [registration_word(item)]
        return [registration_word(by) for pointing, by in self._pointing_elements.items() if item.startswith(pointing)]


@procedure("interior orientation")
def interior_orientation(context: ProcedureContext) -> None:
    """Set fittings, mount and centre both pictures, and set principal distances."""
    context.set_up()


@procedure("measure parallaxes")
def measure_parallaxes(context: ProcedureContext, readings: int = 2) -> None:
    """Clear the y-parallax at the standard points with by', then with by", `readings` times at each."""
    context.take_over()
    context.begin("y-parallaxes")
    for _ in range(readings):
        context.workstation.parallaxes(context.workstation.operators.active, context.points(), 1)


@procedure("relative orientation")
def relative_orientation(context: ProcedureContext) -> None:
    """Orient mounted pictures relatively by the scenario's plan; then look at all points."""
    context.take_over()
    context.begin("relative orientation")
    orient_model(context.workstation, context.model)
    context.begin("last look")
    context.workstation.look_at_parallaxes(context.workstation.operators.active, context.points())


@procedure("day's work")
def full_day(context: ProcedureContext) -> None:
    """Measure all models of the scenario from the first picture to the last centre."""
    for _ in measure_models(context.person, context.workstation.job):
        pass
