"""The chair at the instrument: elements, counters and carriages, and where the mark is by what they show."""

from collections.abc import Mapping, Sequence

import numpy as np

from a7sim.geometry import GON, Array, plane_rotation
from a7sim.manual import VARIANTS, Variant
from a7sim.operator.bench import ELEMENT_NODES, counter_value, wrapped
from a7sim.operator.job import Job, ModelJob
from a7sim.operator.person import Person


class Seat:
    """A person's hands on one instrument. Lengths in mm at instrument scale, readings as the counters show them."""

    def __init__(self, person: Person, job: Job) -> None:
        self.person = person
        self.job = job
        self.model: ModelJob
        self.manual: Variant = VARIANTS["A7"]
        self.units_per_mm = 1.0
        """Of the Z counter."""
        self.z = 0.0
        """How far the mark stood below the base line when the counters were last read."""
        self.c = job.certificate.c
        self.bx = job.plan.bx
        self.by = {1: 0.0, 2: 0.0}
        """By hand, as its counter shows it."""
        self._kappa = {1: 0.0, 2: 0.0}
        self._offset = np.zeros(3)

    def prepare(self) -> None:
        """Bring the instrument to its zeros, engage the gears, set base and projection height."""
        plan = self.job.plan
        self.manual = VARIANTS[self.person.client.ask("*IDN?").split(",")[1]]
        gear = plan.height_gear
        named = isinstance(gear, str)
        self.units_per_mm = self.manual.height_gears[gear].units_per_mm if isinstance(gear, str) else gear
        person = self.person
        person.set("GEAR:HEIG 1", "*RST", f"BASE:BX {plan.bx:.2f}", f"DRIV:Z {-plan.projection_height:.2f}")
        person.set("DRIV:X 0;Y 0")
        height = person.client.numbers("COUN:Z?")[0]
        person.set(f'GEAR:HEIG "{gear}"' if named else f"GEAR:HEIG {gear}", f'GEAR:PLAN "{plan.plan_gear}"')
        self._offset[2] = person.client.numbers("COUN:Z?")[0] - self.units_per_mm * height

    def begin(self, model: ModelJob) -> None:
        """Take up a model whose pictures are mounted."""
        self.model = model
        self.learn_settings()

    def preset(self, readings: tuple[float, float, float]) -> None:
        """Make the counters show these readings where the mark stands."""
        before = np.array(self.person.client.numbers("COUN?"))
        self.person.set("COUN:X:PRES {:.2f};:COUN:Y:PRES {:.2f};:COUN:Z:PRES {:.2f}".format(*readings))
        self._offset += np.array(readings) - before

    # --- elements -------------------------------------------------------------------------------------

    def elements(self, names: Sequence[str]) -> dict[str, float]:
        """Read the counters of elements."""
        answer = self.person.client.numbers(";:".join(f"{header(name)}?" for name in names))
        return dict(zip(names, answer, strict=True))

    def set_elements(self, settings: Mapping[str, float]) -> None:
        """Set elements through their counters, and enter them in the book."""
        for name, value in settings.items():
            shown = f"{counter_value(name, value):.2f}"
            self.person.set(f"{header(name)} {shown}")
            self.person.book.enter(self.person.clock.now, "", f"set {name}", shown)
        self.learn_settings()

    def learn_settings(self) -> None:
        """Read off what the places of images depend on."""
        seen = self.elements(["by1", "by2", "kappa1", "kappa2", "bx"])
        self.bx = seen["bx"]
        for hand in (1, 2):
            projector = self.projector(hand)
            self.by[hand] = seen[f"by{projector}"]
            self._kappa[hand] = wrapped(seen[f"kappa{projector}"]) * GON

    def projector(self, hand: int) -> int:
        """Return the projector of the left-hand (1) or the right-hand (2) photograph."""
        return self.model.left_projector if hand == 1 else self.model.right_projector

    # --- places ---------------------------------------------------------------------------------------

    def counters(self) -> Array:
        """Read X, Y and Z ``(3,)``, and bear in mind how deep the mark stands."""
        readings = np.array(self.person.client.numbers("COUN?"))
        self.z = float((self._offset[2] - readings[2]) / self.units_per_mm)
        return readings

    @property
    def level_now(self) -> float:
        """The Z reading where the mark stands."""
        return float(self.counters()[2])

    def levels_shown(self, levels: tuple[float, float]) -> tuple[float, float]:
        """Return two Z readings as the counter shows them when it is driven there."""
        shown = []
        for level in levels:
            self.drive(f"DRIV:Z {level:.2f}")
            self.see_that_nothing_was_refused(f"driving Z to {level:.2f}")
            shown.append(float(self.counters()[2]))
        return shown[0], shown[1]

    def drive(self, line: str) -> bool:
        """Run carriages; return whether the instrument let them go there."""
        self.person.clock.spend(self.person.observer.seconds_to_drive)
        errors_before, errors = self.person.client.numbers(f"SYST:ERR:COUN?;:{line};:SYST:ERR:COUN?")
        return errors == errors_before

    def drive_z_to(self, height: float) -> bool:
        """Run the mark to a height above the base line, mm, hence negative."""
        return self.drive(f"DRIV:Z {self._offset[2] + height * self.units_per_mm:.2f}")

    def see_that_nothing_was_refused(self, doing: str) -> None:
        """Give up when the instrument has refused anything since the last look."""
        self.person.see_that_it_obeyed(f"{self.model.name}: {doing}")

    def place(self, readings: Array) -> Array:
        """Return X, Y, Z readings ``(3,)`` as x, y, z in mm: from the left-hand centre, the base line, downward."""
        x, y, z = readings - self._offset
        return np.array([x, y, -z / self.units_per_mm])

    def in_frame(self, readings: Array, level: float) -> Array:
        """Return X, Y readings ``(2, n)`` at a Z reading as places x, y, z ``(3, n)`` in mm."""
        z = np.full(readings.shape[1], (self._offset[2] - level) / self.units_per_mm)
        return np.array([readings[0] - self._offset[0], readings[1] - self._offset[1], z])

    def below(self, hand: int) -> Array:
        """Return the X and Y readings ``(2,)`` straight below a photograph's centre, as far as by and bx tell."""
        return np.array([0.0 if hand == 1 else self.bx, -self.by[hand]]) + self._offset[:2]

    def on_carrier(self, hand: int, print_place: Array) -> Array:
        """Return a place of the paper print ``(2,)`` as the swing of its photograph turns it."""
        return plane_rotation(self._kappa[hand]) @ print_place


def header(element: str) -> str:
    """Return the header of an element such as kappa1 or bx."""
    if element == "bx":
        return "BASE:BX"
    if element == "common_phi":
        return "COMM:PHI"
    return f"PROJ{element[-1]}:{ELEMENT_NODES[element[:-1]]}"


def side(hand: int) -> str:
    """Return left or right for a hand."""
    return "left" if hand == 1 else "right"
