"""What the virtual operator can do of an exercise, for references, openings and the skill study: by name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from a7sim.link.client import Client
from a7sim.link.headers import quoted, recorded_as
from a7sim.link.inprocess import InProcessSerial
from a7sim.mistakes import Mistake
from a7sim.operator import DoesNotFit, ModelJob, Person, work
from a7sim.operator.bench import Bench
from a7sim.operator.book import Entry
from a7sim.operator.crew import Crew
from a7sim.operator.interior import InteriorOrientations
from a7sim.operator.line_hands import LineHands
from a7sim.operator.seat import side
from a7sim.operator.work import mount, oriented, set_base_and_fittings, take_up_prints
from a7sim.reduction import Undetermined
from a7sim.session.running import job_of
from a7sim.training.account import ANSWER
from a7sim.training.exercise import Played
from a7sim.training.room import Room


@dataclass(frozen=True)
class Seated:
    """The virtual operator at the instrument of an exercise."""

    person: Person
    bench: Bench
    model: ModelJob

    def set_up(self) -> None:
        """Bring the instrument to the settings of the job sheet, mount and centre pictures, take up the prints."""
        bench = self.bench
        who = bench.crew.everybody
        self.begin("preparation")
        bench.seat.prepare(who)
        self.begin("interior orientation")
        set_base_and_fittings(bench, self.model.base, self.model.polarity)
        found: dict[str, InteriorOrientations] = {}
        mount(bench, self.model, found)
        bench.begin(who, self.model, take_up_prints(bench, self.model))

    def sit_down(self) -> None:
        """Take the instrument over as the opening leaves it, and take up the prints."""
        bench = self.bench
        who = bench.crew.everybody
        bench.seat.take_over(who)
        bench.begin(who, self.model, take_up_prints(bench, self.model))

    def answer(self, answers: Mapping[str, float], decimals: int = 2) -> None:
        """Note answers down at the instrument."""
        for key, value in answers.items():
            self.person.note(f"{ANSWER}{key}={value:.{decimals}f}")

    def begin(self, form: str) -> None:
        """Begin a form of the book."""
        self.bench.crew.begin(self.bench.crew.everybody, self.model.name, form)
        self.person.note(f"{self.model.name}: {form}")


Procedure = Callable[..., None]
"""What takes `Seated` and the options of an exercise."""

PROCEDURES: dict[str, Procedure] = {}
"""All procedures by the names that exercises use."""


def procedure(name: str) -> Callable[[Procedure], Procedure]:
    """Register a procedure under a name."""

    def registered(does: Procedure) -> Procedure:
        PROCEDURES[name] = does
        return does

    return registered


def play(room: Room, played: Played, client: str) -> str:
    """Let the virtual operator do a procedure; return why it was given up, empty where it was not. Raises Mistake."""
    port = InProcessSerial(desk=room.desk, clock=room.clock, client=client, timeout=1.0)
    person = Person(Client(port), room.clock, room.scenario.observer, room.seed)
    job = job_of(room.scenario, room.scene)
    model = next(each for each in job.models if each.name == room.shelved.exercise.model)
    bench = Bench(Crew.of_one(person), LineHands(person), job)
    person.book.listener = _Button(person.client, model).written
    try:
        PROCEDURES[played.procedure](Seated(person, bench, model), **played.options)
    except (DoesNotFit, Undetermined) as trouble:
        return str(trouble) or type(trouble).__name__
    except TypeError as error:
        if "argument" not in str(error):
            raise
        raise Mistake(f"{played.procedure}: expected the options of this procedure: {error}") from error
    finally:
        port.close()
    return ""


REGISTERED_ALREADY = "X"
"""Of a point measured with both eyes the operator has registered all three coordinates before they are entered."""


class _Button:
    """The button of the recording device: what is written into the book is registered as well.

    With the item that is read; a pointing with one eye together with by of its projector, which says whose it is.
    """

    def __init__(self, client: Client, model: ModelJob) -> None:
        self._client = client
        self._model = model
        self._numbers: dict[int, int] = {}

    def written(self, entry: Entry) -> None:
        if entry.struck:
            if entry.number in self._numbers:
                self._client.send(f"REC:STR {self._numbers[entry.number]},{quoted(entry.struck[:60])}")
        elif entry.point and not entry.item.startswith(("set ", "Y", "Z", "parallax seen")):
            if entry.item != REGISTERED_ALREADY:
                self._client.send(f"REC {quoted(entry.point)},{recorded_as(self._element(entry.item))}")
            self._numbers[entry.number] = int(self._client.numbers("REC:COUN?")[0])

    def _element(self, item: str) -> str:
        """Return the element that is registered with an item of the book."""
        if not item.startswith("X "):
            return item
        left = item.startswith(f"X {side(1)}")
        return f"by{self._model.left_projector if left else self._model.right_projector}"


@procedure("interior orientation")
def interior_orientation(seated: Seated) -> None:
    """Fittings, both pictures mounted and centred, principal distances."""
    seated.set_up()


@procedure("measure parallaxes")
def measure_parallaxes(seated: Seated, points: list[str] | None = None, readings: int = 3) -> None:
    """Clear the y-parallax at standard points with by', then with by\", so many times each."""
    seated.set_up()
    labels = points or seated.model.points_of_case(seated.bench.job.plan.case)
    seated.begin("y-parallaxes")
    who = seated.bench.crew.everybody
    seated.bench.parallaxes(who, [seated.model.standard_points[label] for label in labels], readings)


@procedure("relative orientation")
def relative_orientation(seated: Seated) -> None:
    """Relative orientation as the scenario's plan has it."""
    seated.set_up()
    seated.begin("relative orientation")
    oriented(seated.bench, seated.model)


@procedure("day's work")
def days_work(seated: Seated) -> None:
    """All models of the scenario from the first picture to the last centre."""
    for _ in work(seated.person, seated.bench.job):
        pass
