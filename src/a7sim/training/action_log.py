"""Instrument with an action log: all actions in their order, and all registrations with the true state."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from msgspec import Struct

from a7sim.instrument import Autograph
from a7sim.instrument.language import LinkEvent
from a7sim.instrument.language.commands.recording import recorded_element
from a7sim.instrument.language.program import ParsedCommand, ParseFailure, parse_program
from a7sim.instrument.recorder import Recorder, Registration
from a7sim.scenario import Condition
from a7sim.training.exercise import OPENING

AXES = ("X", "Y", "Z")

MOVEMENTS = ("drive", "wheel", "set", "turn")
"""Actions that move a drum or a carriage."""


class StudentAction(Struct, frozen=True, gc=False):
    """Action at the instrument, with the position of its control before and after, as its counter shows it.

    `kind` is 'set' or 'turn' of an element, 'drive' or 'wheel' of an axis, 'preset', 'fit', 'base', 'gear', 'load',
    'unload', 'centre', 'fiducials' (queried), 'reset', 'record', 'strike', 'look' (through one or both eyepieces),
    'note'; `name` the element, axis, fitting, projector or point.
    """

    index: int
    """Counted from 0 in order of occurrence."""
    time: float
    client: str
    kind: str
    name: str = ""
    before: float = 0.0
    after: float = 0.0
    text: str = ""


@dataclass(frozen=True, slots=True)
class Reading:
    """Registration with the state of the instrument at that moment."""

    action_index: int
    """Index among the actions."""
    time: float
    client: str
    number: int
    point: str
    counters: Mapping[str, float]
    """Readings of all counters: X, Y, Z and the elements."""
    elements: tuple[str, ...]
    """Registered elements."""
    sides: Mapping[str, int]
    """By control, +1 if its last movement came from smaller readings, -1 from larger ones; absent if unmoved."""
    fittings: Mapping[str, str]
    base: str
    stereo: tuple[float, float] | None
    """Exact px, py in um at photo scale of the point; None if it is not visible in both eyepieces."""
    eyes: tuple[tuple[float, float] | None, tuple[float, float] | None]
    """Exact dx, dy in um of its image from the mark in either eyepiece."""
    pictures: tuple[str | None, str | None]
    """Pictures in the projectors."""
    mark: tuple[float, float, float]
    """True position of the mark in the frame, mm."""
    struck: bool = False


@dataclass
class ActionLog:
    """Log of an instrument's actions with the true state; all but the truth is also available at the link."""

    actions: list[StudentAction] = field(default_factory=list)
    readings: list[Reading] = field(default_factory=list)
    sides: dict[str, int] = field(default_factory=dict)
    start_time: float = 0.0
    """Simulated time in s at the end of the opening."""
    opened: bool = False
    """Whether the opening is complete."""
    now: float = 0.0
    client: str = ""

    def copy_from(self, other: "ActionLog") -> None:
        """Replace the contents by those of another log."""
        self.actions, self.readings, self.sides = [*other.actions], [*other.readings], dict(other.sides)
        self.start_time, self.opened, self.now, self.client = other.start_time, other.opened, other.now, other.client

    def on_link_event(self, event: LinkEvent) -> None:
        """Record client, time and note of a link event."""
        if event.direction == "<":
            return
        self.now, self.client = event.time, event.client
        if event.direction == "-" and event.client == OPENING:
            self.start_time, self.opened = event.time, True
        if event.direction != ">":
            return
        text = event.text.lower()
        if "note" in text or "fid" in text:
            for unit in parse_program(event.text.encode("latin-1", "replace")):
                self._take_note(unit)

    def _take_note(self, unit: ParsedCommand | ParseFailure) -> None:
        if isinstance(unit, ParsedCommand) and unit.command.header == "NOTE" and unit.given:
            self.add_action("note", text=str(getattr(unit.given[0], "value", "")))
        if isinstance(unit, ParsedCommand) and unit.command.header == "PHOTo<n>:FIDucial?":
            self.add_action("fiducials", str(unit.suffix))

    def add_action(self, kind: str, name: str = "", before: float = 0.0, after: float = 0.0, text: str = "") -> None:
        """Record an action."""
        if kind in MOVEMENTS and before != after:
            self.sides[name] = 1 if after > before else -1
        self.actions.append(StudentAction(len(self.actions), self.now, self.client, kind, name, before, after, text))

    def add_reading(self, autograph: Autograph, registration: Registration) -> None:
        """Record a registration and the state of the instrument."""
        self.add_action("record", registration.point)
        counters = {axis: autograph.counter(axis) for axis in AXES}
        counters |= {name: autograph.element(name) for name in autograph.variant.elements}
        x, y, z = autograph.mark_in_model().tolist()
        left, right = (Autograph.eyepiece(autograph, eye, registration.point) for eye in (1, 2))
        stereo = None if left is None or right is None else (left[0] - right[0], left[1] - right[1])
        self.readings.append(
            Reading(
                len(self.actions) - 1,
                self.now,
                self.client,
                registration.number,
                registration.point,
                counters,
                tuple(recorded_element(word) for word, _ in registration.readings[len(AXES) :]),
                dict(self.sides),
                autograph.fittings.as_words(),
                autograph.base_mode,
                stereo,
                (left, right),
                (autograph.loaded(1), autograph.loaded(2)),
                (x, y, z),
            )
        )

    def strike_reading(self, number: int) -> None:
        """Record that a registration was struck out."""
        self.add_action("strike", str(number))
        self.readings = [replace(each, struck=True) if each.number == number else each for each in self.readings]


class _LoggedRecorder(Recorder):
    def __init__(self, autograph: "LoggedAutograph") -> None:
        super().__init__()
        self._autograph = autograph

    def register(self, point: str, readings: list[tuple[str, str]]) -> Registration:
        registration = super().register(point, readings)
        self._autograph.action_log.add_reading(self._autograph, registration)
        return registration

    def strike(self, number: int, why: str) -> None:
        super().strike(number, why)
        self._autograph.action_log.strike_reading(number)


class LoggedAutograph(Autograph):
    """Instrument that behaves exactly as any other and writes a log. Rejected actions are not logged."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.action_log = ActionLog()
        self.recorder = _LoggedRecorder(self)
        self.blank_pictures = False
        """Whether pictures stay black, for a replay only: they take longer than all the rest."""

    def _counter_reading(self, axis: str) -> float:
        counter = self._counters[axis]
        return counter.offset + counter.units_per_mm * self._carriages[axis].at

    @property
    def z_units_per_mm(self) -> float:
        """Return the units of the Z counter per mm for the engaged gear."""
        return self._counters["Z"].units_per_mm

    @property
    def condition(self) -> Condition:
        """Return the faults of the instrument: part of the truth."""
        return self._condition

    def play(self, handle: str) -> float:
        """Return the play of a carriage or an element: part of the truth."""
        return self._carriages[handle].play if handle in self._carriages else self._spindle(handle).play

    def set_element(self, name: str, value: float) -> None:
        """Set an element by its counter."""
        before = self._spindle(name).at
        super().set_element(name, value)
        self.action_log.add_action("set", name, before, self._spindle(name).at)

    def turn_element(self, name: str, amount: float) -> None:
        """Turn the drum of an element."""
        before = self._spindle(name).at
        super().turn_element(name, amount)
        self.action_log.add_action("turn", name, before, self._spindle(name).at)

    def drive(self, axis: str, reading: float) -> None:
        """Drive a carriage to a reading."""
        before = self._counter_reading(axis)
        super().drive(axis, reading)
        self.action_log.add_action("drive", axis, before, self._counter_reading(axis))

    def turn_handwheel(self, axis: str, amount: float) -> None:
        """Turn a handwheel."""
        before = self._counter_reading(axis)
        super().turn_handwheel(axis, amount)
        self.action_log.add_action("wheel", axis, before, self._counter_reading(axis))

    def preset(self, axis: str, reading: float) -> None:
        """Preset a counter."""
        before = self._counter_reading(axis)
        super().preset(axis, reading)
        self.action_log.add_action("preset", axis, before, self._counter_reading(axis))

    def set_fitting(self, name: str, position: str) -> None:
        """Set a fitting."""
        super().set_fitting(name, position)
        self.action_log.add_action("fit", name, text=position)

    def set_base_mode(self, mode: str) -> None:
        """Set base in or out."""
        super().set_base_mode(mode)
        self.action_log.add_action("base", text=mode)

    def set_height_gear(self, gear: str | float) -> None:
        """Engage a height gear."""
        super().set_height_gear(gear)
        self.action_log.add_action("gear", text=self.height_gear)

    def load(self, projector: int, name: str) -> None:
        """Mount a picture on a carrier."""
        super().load(projector, name)
        self.action_log.add_action("load", str(projector), text=name)

    def unload(self, projector: int) -> None:
        """Remove a picture."""
        super().unload(projector)
        self.action_log.add_action("unload", str(projector))

    def centre_picture(self, projector: int, dx: float, dy: float, dkappa: float) -> None:
        """Shift and rotate a picture on its carrier."""
        super().centre_picture(projector, dx, dy, dkappa)
        self.action_log.add_action("centre", str(projector))

    def reset(self) -> None:
        """Move all to zero."""
        before = {name: spindle.at for name, spindle in self._spindles.items()}
        super().reset()
        self.action_log.add_action("reset")
        for name, spindle in self._spindles.items():
            if spindle.at != before[name]:
                self.action_log.add_action("set", name, before[name], spindle.at)

    def eyepiece(self, eyepiece: int, name: str) -> tuple[float, float] | None:
        """Look at a point through an eyepiece."""
        self.action_log.add_action("look", name)
        return super().eyepiece(eyepiece, name)

    def stereo(self, name: str) -> tuple[float, float] | None:
        """Look at a point with both eyes."""
        self.action_log.add_action("look", name)
        left, right = Autograph.eyepiece(self, 1, name), Autograph.eyepiece(self, 2, name)
        return None if left is None or right is None else (left[0] - right[0], left[1] - right[1])

    def picture(self, eyepiece: int, columns: int, rows: int, magnification: float) -> Any:
        """Look at the picture of an eyepiece."""
        self.action_log.add_action("look")
        if self.blank_pictures:
            return np.zeros((rows, columns))
        return super().picture(eyepiece, columns, rows, magnification)
