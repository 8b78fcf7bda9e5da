"""Working one instrument over its line, in closed loop: look, turn, look again."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from a7sim.geometry import GON, Array, plane_rotation
from a7sim.manual import NOT_VISIBLE, VARIANTS, Variant
from a7sim.operator.bench import (
    ELEMENT_NODES,
    CannotFuse,
    Parallaxes,
    counter_value,
    wrapped,
)
from a7sim.operator.job import Job, ModelJob
from a7sim.operator.person import Person

MOST_LOOKS = 40
MOST_POINTINGS = 12
AGREEMENT_MM = 0.01
"""Two pointings of a model point agree within this (thesis 3.5)."""

AT_REST_MM = 0.0015
"""A handwheel is let go when it would have to be turned by less than this."""

CONTENT_MM = 0.0045
"""With by this near, just below half a least count, no other count can be nearer; beyond it the next is tried."""

LONGEST_RISE_MM = 20.0
"""The foot disc is not turned further than this between two looks."""

RISES_TO_FUSE_MM = (0.0, 20.0, -20.0, 40.0, -40.0, 60.0, -60.0)
"""Where the mark is taken to find the height at which the right eye sees the point as well."""

SEARCH_RINGS = 3
SEARCH_STEP_MM = 14.0
"""At photo scale: how far the operator looks around for a point that is not where the print shows it."""

RUNNING_AWAY_UM = 150.0
RUNNING_AWAY_LOOKS = 3
"""What grows in so many looks in a row, though it is turned down, runs away."""

FAINTEST_SLIP_MM = 0.03
"""A reading of by that differs less than this from its fellows is not taken for a blunder."""

Errors = tuple[float, float]


class LinkBench:
    """A `Bench` at the end of a line. Lengths in mm at instrument scale, readings as the counters show them."""

    def __init__(self, person: Person, job: Job, tick: Callable[[], None] = lambda: None) -> None:
        self.person = person
        self.job = job
        self.model: ModelJob
        self._tick = tick
        self._units = 1.0
        self._offset = np.zeros(3)
        self._sketch: dict[int, dict[str, Array]] = {}
        self._strayed = {1: np.zeros(2), 2: np.zeros(2)}
        self._entries: dict[tuple[int, str, float], tuple[int, int]] = {}
        self._seen_from = np.zeros(2)
        self._z = 0.0
        self._c = job.certificate.c
        self._bx = job.plan.bx
        self._by = {1: 0.0, 2: 0.0}
        self._kappa = {1: 0.0, 2: 0.0}
        self.manual: Variant = VARIANTS["A7"]

    # --- setting up -----------------------------------------------------------------------------------

    def prepare(self) -> None:
        """Bring the instrument to its zeros, engage the gears, set base and projection height."""
        plan = self.job.plan
        self.manual = VARIANTS[self.person.client.ask("*IDN?").split(",")[1]]
        gear = plan.height_gear
        named = isinstance(gear, str)
        self._units = self.manual.height_gears[gear].units_per_mm if isinstance(gear, str) else gear
        person = self.person
        person.set("GEAR:HEIG 1", "*RST", f"BASE:BX {plan.bx:.2f}", f"DRIV:Z {-plan.projection_height:.2f}")
        person.set("DRIV:X 0;Y 0")
        height = person.client.numbers("COUN:Z?")[0]
        person.set(f'GEAR:HEIG "{gear}"' if named else f"GEAR:HEIG {gear}", f'GEAR:PLAN "{plan.plan_gear}"')
        self._offset[2] = person.client.numbers("COUN:Z?")[0] - self._units * height

    def begin(self, model: ModelJob, sketches: Mapping[int, Mapping[str, Array]]) -> None:
        """Take up a model whose pictures are mounted; `sketches` are the paper prints by hand (1 left, 2 right)."""
        self.model = model
        self._sketch = {hand: dict(sketch) for hand, sketch in sketches.items()}
        self._strayed = {1: np.zeros(2), 2: np.zeros(2)}
        self._entries.clear()
        self._learn_settings()

    def preset(self, point: str) -> None:
        """Point at a point in the left-hand photograph and make the counters show the plan's numbers there."""
        plan, person = self.job.plan, self.person
        self._drive_z_to(-plan.projection_height)
        error = person.errors(person.observer.monocular_um, (2,))
        self._bring_into_view(1, point)
        self._bisect(1, point, (float(error[0]), float(error[1])))
        before = np.array(person.client.numbers("COUN?"))
        person.set("COUN:X:PRES {:.2f};:COUN:Y:PRES {:.2f};:COUN:Z:PRES {:.2f}".format(*plan.preset))
        self._offset += np.array(plan.preset) - before

    def levels_shown(self, levels: tuple[float, float]) -> tuple[float, float]:
        """Return two Z readings as the counter shows them when it is driven there."""
        shown = []
        for level in levels:
            self._drive(f"DRIV:Z {level:.2f}")
            self._see_that_nothing_was_refused(f"driving Z to {level:.2f}")
            shown.append(float(self._counters()[2]))
        return shown[0], shown[1]

    def begin_round(self, number: int) -> None:
        """Begin a round of a procedure: what is read now is entered under its number."""
        self.person.book.round = number
        self.person.note(f"{self.model.name}: {self.person.book.form}, round {number}")

    def compute(self) -> None:
        """Spend the time of one computation."""
        self.person.compute()

    def remark(self, text: str) -> None:
        """Write a remark into the book."""
        self.person.remark(text)

    # --- elements -------------------------------------------------------------------------------------

    def elements(self, names: Sequence[str]) -> dict[str, float]:
        """Read the counters of elements."""
        answer = self.person.client.numbers(";:".join(f"{_header(name)}?" for name in names))
        return dict(zip(names, answer, strict=True))

    def set_elements(self, settings: Mapping[str, float]) -> None:
        """Set elements through their counters, and enter them in the book."""
        for name, value in settings.items():
            shown = f"{counter_value(name, value):.2f}"
            self.person.set(f"{_header(name)} {shown}")
            self.person.book.enter(self.person.clock.now, "", f"set {name}", shown)
        self._learn_settings()

    def _learn_settings(self) -> None:
        seen = self.elements(["by1", "by2", "kappa1", "kappa2", "bx"])
        self._bx = seen["bx"]
        for hand in (1, 2):
            projector = self._projector(hand)
            self._by[hand] = seen[f"by{projector}"]
            self._kappa[hand] = wrapped(seen[f"kappa{projector}"]) * GON

    def _projector(self, hand: int) -> int:
        return self.model.left_projector if hand == 1 else self.model.right_projector

    # --- places ---------------------------------------------------------------------------------------

    def _counters(self) -> Array:
        readings = np.array(self.person.client.numbers("COUN?"))
        self._z = float((self._offset[2] - readings[2]) / self._units)
        return readings

    def _drive_z_to(self, height: float) -> bool:
        reading = self._offset[2] + height * self._units
        return self._drive(f"DRIV:Z {reading:.2f}")

    def _see_that_nothing_was_refused(self, doing: str) -> None:
        self.person.see_that_it_obeyed(f"{self.model.name}: {doing}")

    def _drive(self, line: str) -> bool:
        """Run carriages; return whether the instrument let them go there."""
        self.person.clock.spend(self.person.observer.seconds_to_drive)
        errors_before, errors = self.person.client.numbers(f"SYST:ERR:COUN?;:{line};:SYST:ERR:COUN?")
        return errors == errors_before

    def _frame(self, readings: Array) -> Array:
        x, y, z = readings - self._offset
        return np.array([x, y, -z / self._units])

    def in_frame(self, readings: Array, level: float) -> Array:
        """Return X, Y readings ``(2, n)`` at a Z reading as places x, y, z ``(3, n)`` in mm."""
        z = np.full(readings.shape[1], (self._offset[2] - level) / self._units)
        return np.array([readings[0] - self._offset[0], readings[1] - self._offset[1], z])

    @property
    def z_units_per_mm(self) -> float:
        """Units that the Z counter advances a mm."""
        return self._units

    @property
    def level_now(self) -> float:
        """The Z reading where the mark stands."""
        return float(self._counters()[2])

    # --- finding a point ------------------------------------------------------------------------------

    def _bring_into_view(self, hand: int, point: str) -> None:
        print_place = self._sketch[hand].get(point)
        if print_place is None:
            raise self.person.give_up(f"point {point} is not pricked on the print of the {_side(hand)} photograph")
        self._counters()
        expected = plane_rotation(self._kappa[hand]) @ print_place
        origin = np.array([0.0 if hand == 1 else self._bx, -self._by[hand]]) + self._offset[:2]
        for around in _outward():
            place = origin + (expected + self._strayed[hand] + around) * self._z / self._c
            if self._drive("DRIV:X {:.2f};Y {:.2f}".format(*place)) and self._seen(hand, point) is not None:
                self._seen_from = place
                return
        self._see_that_nothing_was_refused(f"looking for point {point}")
        raise self.person.give_up(
            f"{self.model.name}: point {point} is nowhere near where the print shows it in the {_side(hand)} eye, "
            f"not within {SEARCH_RINGS * SEARCH_STEP_MM:.0f} mm: wrong picture in the projector, or the base "
            "setting does not belong to this model"
        )

    def _learn_straying(self, hand: int, point: str, readings: Array) -> None:
        origin = np.array([0.0 if hand == 1 else self._bx, -self._by[hand]]) + self._offset[:2]
        expected = plane_rotation(self._kappa[hand]) @ self._sketch[hand][point]
        self._strayed[hand] = (readings[:2] - origin) * self._c / self._z - expected

    def _seen(self, hand: int, point: str) -> Array | None:
        self.person.look()
        seen = np.array(self.person.client.numbers(f'EYEP{hand}? "{point}"'))
        return None if seen[0] == float(NOT_VISIBLE) else seen

    # --- monocular pointing ---------------------------------------------------------------------------

    def _bisect(self, hand: int, point: str, error: Errors) -> None:
        """Turn X and Y until the image seems to lie at the mark."""
        scale = 1e-3 * self._z / self._c
        watch = _Watch()
        for _ in range(MOST_LOOKS):
            seen = self._seen(hand, point)
            if seen is None or watch.running_away(seen).any():
                raise self._ran_away(hand, point)
            steps = (seen + error) * scale
            if (np.abs(steps) < AT_REST_MM).all():
                return
            self.person.turn("WHE:X {:.3f};Y {:.3f}".format(*steps))
        self._see_that_nothing_was_refused(f"pointing at {point}")
        raise self.person.give_up(f"{self.model.name}: point {point}: the mark cannot be brought to rest on the image")

    def _ran_away(self, hand: int, point: str) -> Exception:
        """Go back to where the point was seen, try each wheel to find out what is wrong, and give up."""
        reasons = []
        for axis, mirror, fitting in (
            (0, "left to right", "diapositive lever"),
            (1, "top to bottom", "Dove prisms"),
        ):
            self._drive("DRIV:X {:.2f};Y {:.2f}".format(*self._seen_from))
            counters, seen = self._counters(), self._seen(hand, point)
            self.person.turn(f"WHE:{'XY'[axis]} 1.00")
            counters_then, seen_then = self._counters(), self._seen(hand, point)
            if counters_then[axis] < counters[axis]:
                reasons.append(f"the {'XY'[axis]} wheel turns the wrong way (its collar)")
            elif seen is not None and seen_then is not None and seen_then[axis] > seen[axis]:
                reasons.append(f"the picture is mirrored {mirror} (the {fitting})")
        reason = " and ".join(reasons) or "it left the field of view"
        return self.person.give_up(
            f"{self.model.name}: point {point} runs away from the mark in the {_side(hand)} eye: {reason}"
        )

    def point_with(self, hand: int, points: Sequence[str], level: float) -> Array:
        """Point with the eye of one photograph at a Z reading; X, Y readings ``(2, n)``."""
        person = self.person
        errors = person.errors(person.observer.monocular_um, (2, len(points)))
        slips = person.slips((2, len(points)))
        self._drive(f"DRIV:Z {level:.2f}")
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
        self._drive(f"DRIV:Z {level:.2f}")
        sigma = self.person.observer.monocular_um
        error = (self.person.error_again(sigma), self.person.error_again(sigma))
        return self._point_once(hand, point, level, error, (self.person.slip_again(), self.person.slip_again()))

    def _point_once(self, hand: int, point: str, level: float, error: Errors, slip: Errors) -> Array:
        person = self.person
        self._bring_into_view(hand, point)
        self._bisect(hand, point, error)
        readings = np.array([person.read("COUN:X?", slip[0]), person.read("COUN:Y?", slip[1])])
        self._learn_straying(hand, point, readings)
        numbers = [
            person.book.enter(person.clock.now, point, f"{axis} {_side(hand)} at Z {level:.2f}", f"{reading:.2f}")
            for axis, reading in zip("XY", readings, strict=True)
        ]
        self._entries[hand, point, level] = (numbers[0], numbers[1])
        self._tick()
        return readings

    # --- stereoscopic setting -------------------------------------------------------------------------

    def _settle(
        self,
        point: str,
        plan_error: Errors,
        height_error: float,
        by: str | None = None,
        parallax_error: float = 0.0,
    ) -> None:
        """Turn X, Y, Z, and by where one is given, until the mark seems to stand on the point."""
        sense = 0.0 if by is None else (1.0 if self.model.hand_of(int(by[-1])) == 1 else -1.0)
        by_now = self.elements([by])[by] if by else 0.0
        watch = _Watch()
        tried: dict[float, float] = {}
        for _ in range(MOST_LOOKS):
            seen = self._looked(point)
            self._see_that_it_fuses(point, watch.running_away(seen), by)
            x, y, _ = self._frame(self._counters())
            scale = 1e-3 * self._z / self._c
            rise = float(seen[2] + height_error) * scale * self._z / abs(self._bx)
            rise = min(max(rise, -LONGEST_RISE_MM), LONGEST_RISE_MM)
            along_the_rays = -rise / self._z * np.array([x - self._bx / 2.0, y])
            dx, dy = (seen[:2] + plan_error) * scale + along_the_rays
            at_rest = max(abs(dx), abs(dy), abs(rise)) < AT_REST_MM
            line = f"WHE:X {dx:.3f};Y {dy:.3f};Z {rise * self._units:.3f}"
            if by is not None:
                by_step = float(sense * (seen[3] + parallax_error) * scale)
                tried[by_now] = abs(by_step)
                by_next = self._next_count(by, by_now, by_step, tried)
                if by_next != by_now:
                    at_rest = False
                    line += f";:{_header(by)} {by_next:.2f}"
                    by_now = by_next
            if at_rest:
                return
            self.person.turn(line)
        self._see_that_nothing_was_refused(f"setting the mark on {point}")
        raise self.person.give_up(
            f"{self.model.name}: point {point} cannot be brought to rest under the mark stereoscopically"
        )

    def _next_count(self, by: str, now: float, step: float, tried: Mapping[float, float]) -> float:
        """Return the count of by to go to: here if it is content, else the nearest not tried, else the best tried."""
        if abs(step) < CONTENT_MM:
            return now
        wanted = round(now + math.copysign(max(abs(step), 0.01), step), 2)
        if not self.manual.elements[by].low <= wanted <= self.manual.elements[by].high:
            raise CannotFuse(by)
        if wanted in tried and abs(wanted - now) < 0.015:
            return now if tried[now] <= tried[wanted] else wanted
        return wanted

    def _looked(self, point: str) -> Array:
        """Return what both eyes see: x and y from the mark (mean of both), px, py, in um."""
        self.person.look()
        lx, ly, rx, ry = self.person.client.numbers(f'EYEP1? "{point}";:EYEP2? "{point}"')
        if float(NOT_VISIBLE) in (lx, rx):
            raise CannotFuse(point)
        return np.array([(lx + rx) / 2.0, (ly + ry) / 2.0, lx - rx, ly - ry])

    def _see_that_it_fuses(self, point: str, running_away: Array, by: str | None) -> None:
        if running_away[2]:
            raise self.person.give_up(
                f"{self.model.name}: point {point}: the x-parallax grows when the mark is moved to clear it, the "
                "relief is inside out: the eyes see each other's pictures (triangulation lever, base)"
            )
        if by and running_away[3]:
            raise self.person.give_up(
                f"{self.model.name}: point {point}: the y-parallax grows when {by} is turned to clear it: the picture "
                "is mirrored or the base is set for the other arrangement"
            )

    def _fuse(self, point: str, plan_error: Errors, height_error: float) -> None:
        self._bring_into_view(1, point)
        height = -self._z
        for rise in RISES_TO_FUSE_MM:
            if rise:
                if not self._drive_z_to(height + rise):
                    self.person.client.errors()
                    continue
                self._bring_into_view(1, point)
            self._bisect(1, point, (0.0, 0.0))
            if self._seen(2, point) is not None:
                self._settle(point, plan_error, height_error)
                return
        self._drive_z_to(height)
        raise CannotFuse(point)

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
                self._fuse(point, plan_error, float(height_errors[i]))
                counters = self._counters()
                places[:, i] = self._frame(counters)
                self._learn_straying(1, point, counters)
                read: list[tuple[str, float, int]] = []
                for projector in (1, 2):
                    by = f"by{projector}"
                    for k in range(readings):
                        error = float(errors[i, projector - 1, k])
                        self._settle(point, plan_error, float(height_errors[i]), by, error)
                        read.append(self._read_by(point, by, rest[by], float(slips[i, projector - 1, k])))
                    person.turn(f"{_header(by)} {rest[by]:.2f}")
                p[i] = self._mean_parallax(point, read, rest, plan_error, float(height_errors[i]))
            except CannotFuse:
                person.turn(";:".join(f"{_header(by)} {rest[by]:.2f}" for by in rest))
                raise
            self._tick()
        person.see_that_it_obeyed(f"{self.model.name}: measuring y-parallaxes")
        return Parallaxes(p, places)

    def _read_by(self, point: str, by: str, rest: float, slip: float) -> tuple[str, float, int]:
        reading = self.person.read(f"{_header(by)}?", slip)
        number = self.person.book.enter(self.person.clock.now, point, by, f"{reading:.2f}")
        sense = 1.0 if self.model.hand_of(int(by[-1])) == 1 else -1.0
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
        tolerance = FAINTEST_SLIP_MM + 5e-3 * observer.parallax_um * self._z / self._c
        for _ in range(MOST_POINTINGS):
            values = np.array([value for _, value, _ in read])
            deviations = np.abs(values - np.median(values))
            worst = int(deviations.argmax())
            if deviations[worst] <= tolerance:
                return float(np.mean([values[[by == each for each, _, _ in read]].mean() for by in ("by1", "by2")]))
            by, _, number = read[worst]
            self.person.book.strike(number, f"does not agree with the other readings of by' and by\" at {point}")
            error = self.person.error_again(observer.parallax_um)
            self._settle(point, plan_error, height_error, by, error)
            read[worst] = self._read_by(point, by, rest[by], self.person.slip_again())
            self.person.turn(f"{_header(by)} {rest[by]:.2f}")
        raise self.person.give_up(f"{self.model.name}: the readings of by' and by\" at {point} do not agree")

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
        person.see_that_it_obeyed(f"{self.model.name}: measuring model coordinates")
        return measured

    def _pointing(self, point: str, error: Array, slips: Array) -> tuple[Array, list[int]]:
        person = self.person
        self._fuse(point, (float(error[0]), float(error[1])), float(error[2]))
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
        difference = np.abs(first[0] - second[0]) / (1.0, 1.0, self._units)
        return bool((difference <= AGREEMENT_MM + 1e-9).all())

    def _strike(self, pointing: tuple[Array, list[int]], why: str) -> None:
        for number in pointing[1]:
            self.person.book.strike(number, why)


class _Watch:
    """Watches whether displacements grow though they are being turned down."""

    def __init__(self) -> None:
        self._before: Array | None = None
        self._times: Array | int = 0

    def running_away(self, seen: Array) -> Array:
        """Return which of the displacements in um have grown in look after look."""
        before, self._before = self._before, np.abs(seen)
        if before is None:
            return np.zeros(seen.shape, dtype=bool)
        grown = (self._before > 1.4 * before) & (self._before > RUNNING_AWAY_UM)
        self._times = np.where(grown, self._times + 1, 0)
        return np.asarray(self._times >= RUNNING_AWAY_LOOKS)


def _header(element: str) -> str:
    return "BASE:BX" if element == "bx" else f"PROJ{element[-1]}:{ELEMENT_NODES[element[:-1]]}"


def _side(hand: int) -> str:
    return "left" if hand == 1 else "right"


def _outward() -> Iterator[Array]:
    """Yield shifts in mm at photo scale, from the middle outward in rings."""
    yield np.zeros(2)
    for ring in range(1, SEARCH_RINGS + 1):
        for direction in np.arange(6 * ring) * (2.0 * np.pi / (6 * ring)):
            yield ring * SEARCH_STEP_MM * np.array([np.cos(direction), np.sin(direction)])
