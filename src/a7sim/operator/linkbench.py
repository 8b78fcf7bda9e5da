"""Working one instrument over its line, in closed loop: look, turn, look again."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from a7sim.geometry import Array
from a7sim.operator.bench import CannotFuse, Parallaxes
from a7sim.operator.eyes import Errors, Eyes
from a7sim.operator.floating_mark import Clearing, FloatingMark
from a7sim.operator.job import Job, ModelJob
from a7sim.operator.person import Person
from a7sim.operator.seat import Seat, header, side

MOST_POINTINGS = 12
AGREEMENT_MM = 0.01
"""Two pointings of a model point agree within this (thesis 3.5)."""

FAINTEST_SLIP_MM = 0.03
"""A reading of by that differs less than this from its fellows is not taken for a blunder."""


class LinkBench:
    """A `Bench` at the end of a line."""

    def __init__(self, person: Person, job: Job, tick: Callable[[], None] = lambda: None) -> None:
        self.person = person
        self.job = job
        self.seat = Seat(person, job)
        self.eyes = Eyes(self.seat)
        self.mark = FloatingMark(self.eyes)
        self._tick = tick
        self._entries: dict[tuple[int, str, float], tuple[int, int]] = {}

    # --- setting up -----------------------------------------------------------------------------------

    def prepare(self) -> None:
        """Bring the instrument to its zeros, engage the gears, set base and projection height."""
        self.seat.prepare()

    def begin(self, model: ModelJob, sketches: Mapping[int, Mapping[str, Array]]) -> None:
        """Take up a model whose pictures are mounted; `sketches` are the paper prints by hand (1 left, 2 right)."""
        self.eyes.take_prints(sketches)
        self._entries.clear()
        self.seat.begin(model)

    def preset(self, point: str) -> None:
        """Point at a point in the left-hand photograph and make the counters show the plan's numbers there."""
        plan, person = self.job.plan, self.person
        self.seat.drive_z_to(-plan.projection_height)
        error = person.errors(person.observer.monocular_um, (2,))
        self.eyes.bring_into_view(1, point)
        self.eyes.bisect(1, point, (float(error[0]), float(error[1])))
        self.seat.preset(plan.preset)

    def elements(self, names: Sequence[str]) -> dict[str, float]:
        """Read the counters of elements."""
        return self.seat.elements(names)

    def set_elements(self, settings: Mapping[str, float]) -> None:
        """Set elements through their counters, and enter them in the book."""
        self.seat.set_elements(settings)

    def in_frame(self, readings: Array, level: float) -> Array:
        """Return X, Y readings ``(2, n)`` at a Z reading as places x, y, z ``(3, n)`` in mm."""
        return self.seat.in_frame(readings, level)

    @property
    def z_units_per_mm(self) -> float:
        """Units that the Z counter advances a mm."""
        return self.seat.units_per_mm

    @property
    def level_now(self) -> float:
        """The Z reading where the mark stands."""
        return self.seat.level_now

    def levels_shown(self, levels: tuple[float, float]) -> tuple[float, float]:
        """Return two Z readings as the counter shows them when it is driven there."""
        return self.seat.levels_shown(levels)

    def begin_round(self, number: int) -> None:
        """Begin a round of a procedure: what is read now is entered under its number."""
        self.person.book.round = number
        self.person.note(f"{self.seat.model.name}: {self.person.book.form}, round {number}")

    def compute(self) -> None:
        """Spend the time of one computation."""
        self.person.compute()

    def remark(self, text: str) -> None:
        """Write a remark into the book."""
        self.person.remark(text)

    # --- monocular pointing ---------------------------------------------------------------------------

    def point_with(self, hand: int, points: Sequence[str], level: float) -> Array:
        """Point with the eye of one photograph at a Z reading; X, Y readings ``(2, n)``."""
        person = self.person
        errors = person.errors(person.observer.monocular_um, (2, len(points)))
        slips = person.slips((2, len(points)))
        self.seat.drive(f"DRIV:Z {level:.2f}")
        person.see_that_it_obeyed(f"driving Z to {level:.2f}")
        readings = np.zeros((2, len(points)))
        for i, point in enumerate(points):
            error = (float(errors[0, i]), float(errors[1, i]))
            slip = (float(slips[0, i]), float(slips[1, i]))
            readings[:, i] = self._point_once(hand, point, level, error, slip)
        return readings

    def point_again(self, hand: int, point: str, level: float, why: str) -> Array:
        """Strike out a pointing and make it once more; X, Y ``(2,)``."""
        for number in self._entries[hand, point, level]:
            self.person.book.strike(number, why)
        self.seat.drive(f"DRIV:Z {level:.2f}")
        sigma = self.person.observer.monocular_um
        error = (self.person.error_again(sigma), self.person.error_again(sigma))
        return self._point_once(hand, point, level, error, (self.person.slip_again(), self.person.slip_again()))

    def _point_once(self, hand: int, point: str, level: float, error: Errors, slip: Errors) -> Array:
        person = self.person
        self.eyes.bring_into_view(hand, point)
        self.eyes.bisect(hand, point, error)
        readings = np.array([person.read("COUN:X?", slip[0]), person.read("COUN:Y?", slip[1])])
        self.eyes.learn_straying(hand, point, readings)
        numbers = [
            person.book.enter(person.clock.now, point, f"{axis} {side(hand)} at Z {level:.2f}", f"{reading:.2f}")
            for axis, reading in zip("XY", readings, strict=True)
        ]
        self._entries[hand, point, level] = (numbers[0], numbers[1])
        self._tick()
        return readings

    # --- y-parallaxes ---------------------------------------------------------------------------------

    def parallaxes(self, points: Sequence[str], readings: int) -> Parallaxes:
        """Measure y-parallaxes with by' and by", so many readings of each. Raises CannotFuse."""
        person, observer = self.person, self.person.observer
        n = len(points)
        plan_errors = person.errors(observer.stereo_um, (2, n))
        height_errors = person.errors(observer.height_um, (n,))
        errors = person.errors(observer.parallax_um, (n, 2, readings))
        slips = person.slips((n, 2, readings))
        rest = self.elements(["by1", "by2"])
        p, places = np.zeros(n), np.zeros((3, n))
        for i, point in enumerate(points):
            plan_error = (float(plan_errors[0, i]), float(plan_errors[1, i]))
            try:
                self.mark.fuse(point, plan_error, float(height_errors[i]))
                counters = self.seat.counters()
                places[:, i] = self.seat.place(counters)
                self.eyes.learn_straying(1, point, counters)
                read: list[tuple[str, float, int]] = []
                for projector in (1, 2):
                    by = f"by{projector}"
                    for k in range(readings):
                        error = float(errors[i, projector - 1, k])
                        self.mark.settle(point, plan_error, float(height_errors[i]), self._clearing(by, error))
                        read.append(self._read_by(point, by, rest[by], float(slips[i, projector - 1, k])))
                    person.turn(f"{header(by)} {rest[by]:.2f}")
                p[i] = self._mean_parallax(point, read, rest, plan_error, float(height_errors[i]))
            except CannotFuse:
                person.turn(";:".join(f"{header(by)} {rest[by]:.2f}" for by in rest))
                raise
            self._tick()
        person.see_that_it_obeyed(f"{self.seat.model.name}: measuring y-parallaxes")
        return Parallaxes(p, places)

    def _clearing(self, by: str, error: float) -> Clearing:
        return Clearing(by, -1.0 if self.seat.model.hand_of(int(by[-1])) == 1 else 1.0, error)

    def _read_by(self, point: str, by: str, rest: float, slip: float) -> tuple[str, float, int]:
        reading = self.person.read(f"{header(by)}?", slip)
        number = self.person.book.enter(self.person.clock.now, point, by, f"{reading:.2f}")
        sense = 1.0 if self.seat.model.hand_of(int(by[-1])) == 1 else -1.0
        return by, sense * (reading - rest), number

    def _mean_parallax(
        self,
        point: str,
        read: list[tuple[str, float, int]],
        rest: Mapping[str, float],
        plan_error: Errors,
        height_error: float,
    ) -> float:
        """Return the mean of the readings; one that its fellows contradict is struck out and read again."""
        observer = self.person.observer
        tolerance = FAINTEST_SLIP_MM + 5e-3 * observer.parallax_um * self.seat.z / self.seat.c
        for _ in range(MOST_POINTINGS):
            values = np.array([value for _, value, _ in read])
            deviations = np.abs(values - np.median(values))
            worst = int(deviations.argmax())
            if deviations[worst] <= tolerance:
                return float(np.mean([values[[by == each for each, _, _ in read]].mean() for by in ("by1", "by2")]))
            by, _, number = read[worst]
            self.person.book.strike(number, f"does not agree with the other readings of by' and by\" at {point}")
            error = self.person.error_again(observer.parallax_um)
            self.mark.settle(point, plan_error, height_error, self._clearing(by, error))
            read[worst] = self._read_by(point, by, rest[by], self.person.slip_again())
            self.person.turn(f"{header(by)} {rest[by]:.2f}")
        raise self.person.give_up(f"{self.seat.model.name}: the readings of by' and by\" at {point} do not agree")

    # --- model coordinates ----------------------------------------------------------------------------

    def measure(self, points: Sequence[str]) -> Array:
        """Measure model points stereoscopically, two pointings that agree; X, Y, Z readings ``(3, n)``.

        A point whose images cannot be fused is remarked upon and comes out as NaN.
        """
        person, observer = self.person, self.person.observer
        n = len(points)
        at_point = person.errors(1.0, (3, n)) * np.sqrt(1.0 - observer.repeat_share**2)
        anew = person.errors(1.0, (3, n, 2)) * observer.repeat_share
        sigmas = np.array([observer.stereo_um, observer.stereo_um, observer.height_um])
        slips = person.slips((3, n, 2))
        measured = np.zeros((3, n))
        for i, point in enumerate(points):
            try:
                pointings = [
                    self._pointing(point, sigmas * (at_point[:, i] + anew[:, i, k]), slips[:, i, k]) for k in (0, 1)
                ]
            except CannotFuse:
                person.remark(f"point {point}: its two images cannot be fused, not measured")
                measured[:, i] = np.nan
                continue
            while not self._agree(pointings[-2], pointings[-1]) and len(pointings) < MOST_POINTINGS:
                self._strike(pointings[-2], "two pointings differ by more than 0.01 mm")
                again = np.array([person.error_again(observer.repeat_share) for _ in range(3)])
                slip = np.array([person.slip_again() for _ in range(3)])
                pointings.append(self._pointing(point, sigmas * (at_point[:, i] + again), slip))
            if self._agree(pointings[-2], pointings[-1]):
                accepted = np.array([pointings[-2][0], pointings[-1][0]])
                measured[:, i] = accepted.mean(axis=0)
            else:
                measured[:, i] = np.median([readings for readings, _ in pointings], axis=0)
                person.remark(f"point {point}: no two of {MOST_POINTINGS} pointings agree, median taken")
            self._tick()
        person.see_that_it_obeyed(f"{self.seat.model.name}: measuring model coordinates")
        return measured

    def _pointing(self, point: str, error: Array, slips: Array) -> tuple[Array, list[int]]:
        person = self.person
        self.mark.fuse(point, (float(error[0]), float(error[1])), float(error[2]))
        readings = np.array(
            [person.read(f"COUN:{axis}?", float(slip)) for axis, slip in zip("XYZ", slips, strict=True)]
        )
        person.client.send(f'REC "{point}"')
        numbers = [
            person.book.enter(person.clock.now, point, axis, f"{reading:.2f}")
            for axis, reading in zip("XYZ", readings, strict=True)
        ]
        return readings, numbers

    def _agree(self, first: tuple[Array, list[int]], second: tuple[Array, list[int]]) -> bool:
        difference = np.abs(first[0] - second[0]) / (1.0, 1.0, self.seat.units_per_mm)
        return bool((difference <= AGREEMENT_MM + 1e-9).all())

    def _strike(self, pointing: tuple[Array, list[int]], why: str) -> None:
        for number in pointing[1]:
            self.person.book.strike(number, why)
