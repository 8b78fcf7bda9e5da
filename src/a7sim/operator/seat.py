"""The chair at the instrument: elements, counters and carriages, and where the mark is by what they show."""

from collections.abc import Mapping, Sequence

import numpy as np

from a7sim.geometry import GON, Array, mxv, plane_rotation
from a7sim.manual import VARIANTS, Variant
from a7sim.operator.crew import Crew, Who
from a7sim.operator.hands import Hands, Truths
from a7sim.operator.job import Job, ModelJob

STEADY = ("kappa1", "kappa2", "by1", "by2", "bx")
"""Elements on which the places of images depend to first order."""


class Seat:
    """The hands of a crew on their instruments. Lengths in mm at instrument scale, readings as counters show them.

    Arrays have the sessions as their last axis: all of them in what is kept here, those that act in what is handed
    over.
    """

    def __init__(self, crew: Crew, hands: Hands, job: Job) -> None:
        self.crew = crew
        self.hands = hands
        self.job = job
        self.model: ModelJob
        self.manual: Variant = VARIANTS["A7"]
        self.units_per_mm = 1.0
        """Of the Z counter."""
        self.z = np.zeros(crew.sessions)
        """How far the mark stood below the base line when the counters were last read."""
        self.c = job.certificate.c
        self._settings = {name: np.zeros(crew.sessions) for name in STEADY}
        self._offset = np.zeros((3, crew.sessions))

    def prepare(self, who: Who) -> None:
        """Bring the instruments to their zeros, engage the gears, set base and projection height."""
        plan, hands = self.job.plan, self.hands
        self.manual = VARIANTS[hands.variant()]
        gear = plan.height_gear
        self.units_per_mm = self.manual.height_gears[gear].units_per_mm if isinstance(gear, str) else gear
        hands.engage(who, 1.0, plan.plan_gear)
        hands.reset(who)
        self.spend_setting(who, 6)
        hands.set_element(who, "bx", np.full(who.size, plan.bx))
        hands.drive(who, {"Z": np.full(who.size, -plan.projection_height)})
        hands.drive(who, {"X": np.zeros(who.size), "Y": np.zeros(who.size)})
        height = hands.counter(who, "Z")
        hands.engage(who, gear, plan.plan_gear)
        self.see_that_it_obeyed(who, "preparing the instrument")
        self._offset[2, who] = hands.counter(who, "Z") - self.units_per_mm * height

    def begin(self, who: Who, model: ModelJob) -> None:
        """Take up a model whose pictures are mounted."""
        self.model = model
        self.learn_settings(who)

    def preset(self, who: Who, readings: tuple[float, float, float]) -> None:
        """Make the counters show these readings where the mark stands."""
        before = self.hands.counters(who)
        self.spend_setting(who)
        self.hands.preset(who, readings)
        self.see_that_it_obeyed(who, "presetting the counters")
        self._offset[:, who] += np.array(readings)[:, None] - before

    def spend_setting(self, who: Who, times: int = 1) -> None:
        """Let the time of setting something go by."""
        self.crew.spend(who, times * self.crew.observer.seconds_to_set)

    # --- elements -------------------------------------------------------------------------------------

    def elements(self, who: Who, names: Sequence[str]) -> dict[str, Array]:
        """Read the counters of elements ``(m,)``."""
        return self.hands.elements(who, names)

    def set_elements(self, who: Who, settings: Mapping[str, Array]) -> None:
        """Set elements through their counters to values ``(m,)``, and enter them in the book."""
        for name, value in settings.items():
            counts = counter_value(name, value)
            self.spend_setting(who)
            self.hands.set_element(who, name, counts)
            self.see_that_it_obeyed(who, f"setting {name}")
            self.crew.enter(who, "", f"set {name}", counts)
        self.learn_settings(self.crew.still(who))

    def learn_settings(self, who: Who) -> None:
        """Read off what the places of images depend on."""
        for name, counts in self.elements(who, [name for name in STEADY if name in self.manual.elements]).items():
            self._settings[name][who] = counts

    def projector(self, hand: int) -> int:
        """Return the projector of the left-hand (1) or the right-hand (2) photograph."""
        return self.model.left_projector if hand == 1 else self.model.right_projector

    def bx(self, who: Who) -> Array:
        """Return the base as it is set ``(m,)``, mm."""
        return self._settings["bx"][who]

    # --- places ---------------------------------------------------------------------------------------

    def counters(self, who: Who) -> Array:
        """Read X, Y and Z ``(3, m)``, and bear in mind how deep the mark stands."""
        readings = self.hands.counters(who)
        self.z[who] = (self._offset[2, who] - readings[2]) / self.units_per_mm
        return readings

    def levels_shown(self, who: Who, levels: tuple[float, float]) -> Array:
        """Return two Z readings ``(2, m)`` as the counters show them when they are driven there."""
        shown = []
        for level in levels:
            self.drive(who, {"Z": np.full(who.size, level)})
            self.see_that_it_obeyed(who, f"driving Z to {level:.2f}")
            shown.append(self.counters(who)[2])
        return np.array(shown)

    def drive(self, who: Who, readings: Mapping[str, Array]) -> Truths:
        """Run carriages to readings ``(m,)``; return which instruments let them go there."""
        self.crew.spend(who, self.crew.observer.seconds_to_drive)
        return self.hands.drive(who, readings)

    def drive_z_to(self, who: Who, height: Array) -> Truths:
        """Run the mark to heights ``(m,)`` above the base line, mm, hence negative."""
        return self.drive(who, {"Z": self._offset[2, who] + height * self.units_per_mm})

    def turn(self, who: Who, wheels: Array, element: str | None = None, counts: Array | None = None) -> None:
        """Turn the handwheels ``(2 or 3, m)`` in counter units and an element with them (see `Hands`)."""
        self.crew.spend(who, self.crew.observer.seconds_to_turn)
        self.hands.turn(who, wheels, element, counts)

    def see_that_it_obeyed(self, who: Who, doing: str) -> None:
        """Give up where an instrument has refused anything since the last look."""
        refused = self.hands.refused(who)
        if refused:
            sessions = np.array(sorted(refused), dtype=np.intp)
            self.crew.give_up(
                sessions, lambda session: f"{doing}: the instrument refuses: {'; '.join(refused[session][:2])}"
            )

    def place(self, who: Who, readings: Array) -> Array:
        """Return readings ``(3, m)`` as x, y, z in mm: from the left-hand centre, the base line, downward."""
        x, y, z = readings - self._offset[:, who]
        return np.array([x, y, -z / self.units_per_mm])

    def in_frame(self, who: Who, readings: Array, level: Array) -> Array:
        """Return X, Y readings ``(2, n, m)`` at Z readings ``(m,)`` as places x, y, z ``(3, n, m)`` in mm."""
        x, y = readings - self._offset[:2, None, who]
        z = np.broadcast_to((self._offset[2, who] - level) / self.units_per_mm, x.shape)
        return np.array([x, y, z])

    def below(self, who: Who, hand: int) -> Array:
        """Return the X and Y readings ``(2, m)`` straight below a photograph's centre, as far as by and bx tell."""
        x = np.zeros(who.size) if hand == 1 else self.bx(who)
        return np.array([x, -self._settings[f"by{self.projector(hand)}"][who]]) + self._offset[:2, who]

    def on_carrier(self, who: Who, hand: int, print_place: Array) -> Array:
        """Return places of paper prints ``(2, m)`` as the swing of their photograph turns them."""
        swing = wrapped(self._settings[f"kappa{self.projector(hand)}"][who]) * GON
        return mxv(plane_rotation(swing), print_place)


def wrapped(gon: Array) -> Array:
    """Return angles within 200 gon of zero."""
    return np.asarray((gon + 200.0) % 400.0 - 200.0)


def counter_value(name: str, value: Array) -> Array:
    """Return what the counter of an element must show, kappa brought to 0..400."""
    return np.asarray(np.round(value % 400.0, 2) % 400.0 if name.startswith("kappa") else np.round(value, 2))


def side(hand: int) -> str:
    """Return left or right for a hand."""
    return "left" if hand == 1 else "right"
