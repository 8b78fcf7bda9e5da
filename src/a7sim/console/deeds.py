"""What every key does: a method a deed, each one order to the station or one change of the view."""

from dataclasses import replace
from functools import partial
from typing import Any

from a7sim.console.bench import BenchDeeds
from a7sim.console.book import Entry, record
from a7sim.console.dialogs import Ask, Choose, HelpPage
from a7sim.console.eyepiece import Drawing
from a7sim.console.hands import title, unit
from a7sim.console.reaching import Reach
from a7sim.link.client import Client
from a7sim.link.exchange import say
from a7sim.link.headers import header, quoted, recorded_as

MAGNIFICATIONS = (1.0, 2.0, 4.0, 8.0, 12.0, 20.0, 40.0)
EYES = ((1, 2), (1,), (2,))
MERGED = ("side by side", "anaglyph", "flicker")
WHY = "struck out at the console"

_TURNS = {
    "x_up": ("X", 1),
    "x_down": ("X", -1),
    "y_up": ("Y", 1),
    "y_down": ("Y", -1),
    "z_up": ("Z", 1),
    "z_down": ("Z", -1),
}
_TAKEN = ("kappa", "phi", "omega", "by", "bz", "c", "bx", "common_phi")
_BEFORE_ANYTHING_ANSWERS = ("quit", "help")


class Deeds(BenchDeeds):
    """The deeds of a console."""

    def do(self, name: str) -> None:
        """Do what a key or the palette asks for."""
        console = self._console
        if console.dials is None and name not in _BEFORE_ANYTHING_ANSWERS:
            return
        if name in _TURNS:
            self.move(*_TURNS[name])
        elif name in _TAKEN:
            self.take_up(name)
        else:
            getattr(self, f"do_{name}")()

    # --- hands ----------------------------------------------------------------------------------------

    def move(self, axis: str, way: int) -> None:
        """Turn a handwheel or the foot disc by a step."""
        console = self._console
        hands = console.hands

        def order(client: Client) -> None:
            reading = float(client.ask(f"COUN:{axis}?")) if hands.free and axis != "Z" else 0.0
            client.send(hands.moved(axis, way, reading))

        console.station.order(order)

    def take_up(self, name: str) -> None:
        """Take up an element, if the plotter has it."""
        console = self._console
        variant, _ = self._at()
        taken = replace(console.hands, name=name)
        if taken.element not in variant.elements:
            console.say(f"an {variant.name} has no {name.replace('_', ' ')}", refused=True)
            return
        self._hold(taken)

    def do_left_side(self) -> None:
        """Take the left projector's."""
        self._hold(replace(self._console.hands, side=1))

    def do_right_side(self) -> None:
        """Take the right projector's."""
        self._hold(replace(self._console.hands, side=2))

    def do_finer(self) -> None:
        """Make the step smaller."""
        self._hold(self._console.hands.stepping(-1))

    def do_coarser(self) -> None:
        """Make the step larger."""
        self._hold(self._console.hands.stepping(1))

    def do_turn_up(self) -> None:
        """Turn the element in hand forward."""
        self._console.station.say(self._console.hands.turned(1))

    def do_turn_down(self) -> None:
        """Turn the element in hand back."""
        self._console.station.say(self._console.hands.turned(-1))

    def wheel(self, drum: str, way: int) -> None:
        """Turn the drum under the mouse; an element is taken up by it."""
        console = self._console
        if console.dials is None:
            return
        if drum in ("X", "Y", "Z"):
            self.move(drum, way)
            return
        bare = drum in ("bx", "common_phi")
        self._hold(
            replace(console.hands, name=drum if bare else drum[:-1], side=console.hands.side if bare else int(drum[-1]))
        )
        if way:
            console.station.say(console.hands.turned(way))

    def do_free_hand(self) -> None:
        """Let X and Y go free of the wheels, or take the wheels again."""
        console = self._console
        free = not console.hands.free
        self._hold(replace(console.hands, free=free))
        console.say(
            "free hand: X and Y move without the wheels; click a place to bring it under the mark"
            if free
            else "hands at the wheels"
        )

    def clicked(self, across: int, up: int) -> None:
        """In free hand, bring a place of the left eyepiece's picture under the mark."""
        console = self._console
        sight, hands = console.sight, console.hands
        if not hands.free or sight is None or not sight.look.columns:
            return
        variant, dials = self._at()
        look = sight.look
        pitch = 2.0 * variant.field_radius_mm / (look.magnification * max(look.columns, look.rows))
        height = abs(console.presets.frame(variant, dials)[2])
        scale = pitch * height / dials.element("c1")
        dx, dy = across * scale, 2 * up * scale
        x, y = (console.presets.unit(variant, axis) * each for axis, each in (("X", dx), ("Y", dy)))
        console.station.say(f"DRIV:X {dials.counter('X') + x:.2f};Y {dials.counter('Y') + y:.2f}")

    # --- readings typed in ----------------------------------------------------------------------------

    def do_set(self) -> None:
        """Set the element in hand to a reading."""
        console = self._console
        variant, dials = self._at()
        element = console.hands.element
        data = variant.elements[element]
        note = f"{data.low:g} to {data.high:g} {unit(variant, element)}; it stands at {dials.elements[element]}"
        self._ask_number(
            f"set {title(element)} to", note, lambda value: console.station.say(f"{header(element)} {value:g}")
        )

    def do_drive(self) -> None:
        """Run carriages to readings."""
        self._ask_axes("run to readings", "such as: X 97.5 Y -12 Z -325.71", self._drive)

    def _drive(self, readings: list[tuple[str, str]]) -> None:
        self._console.station.say(*(f"DRIV:{axis} {reading}" for axis, reading in readings))

    def do_say(self) -> None:
        """Say a line of the command language."""
        self._console.push_screen(Ask("say", note="a line of the command language"), self._said)

    def _said(self, line: str | None) -> None:
        console = self._console
        if line is not None:

            def shown(exchange: Any) -> None:
                console.say(
                    exchange.shown or " ".join(exchange.errors) or f"said {line}", refused=bool(exchange.errors)
                )

            console.ask(lambda client: say(client, line), shown)

    # --- points ---------------------------------------------------------------------------------------

    def do_go_to(self) -> None:
        """Choose a point of the sketch and drive near it."""
        console = self._console
        projector = console.hands.side if console.sketches[console.hands.side] else 3 - console.hands.side
        points = console.sketches[projector]
        if not points:
            console.say("there is no sketch: lay a picture first (l)", refused=True)
            return
        other = console.sketches[3 - projector]
        common = sorted((name for name in points if name in other), key=str)
        lone = sorted((name for name in points if name not in other), key=str)
        choices = [(name, f"{name:<8}in both pictures") for name in common] + [(name, name) for name in lone]

        def chosen(name: str | None) -> None:
            if name is not None:
                self.drive_near(projector, name)

        console.push_screen(Choose("drive near a point", choices), chosen)

    def drive_near(self, projector: int, point: str) -> None:
        """Drive near a point of the sketch of what lies in a projector."""
        console = self._console
        variant, dials = self._at()
        reach = Reach(variant, dials, console.presets, projector, console.sketches[projector])
        console.point = point

        def arrived(there: bool) -> None:
            console.say(
                f"near point {point}" if there else f"point {point} is not to be seen where the sketch shows it",
                refused=not there,
            )
            console.look()
            console.refresh_panels()

        console.say(f"driving to point {point} ...")
        console.ask(partial(reach.near, point=point), arrived)

    # --- the book -------------------------------------------------------------------------------------

    def do_record(self) -> None:
        """Record a reading of the point gone to, or ask for its name."""
        console = self._console
        if console.point is not None:
            self._record(console.point)
        else:
            console.push_screen(Ask("record: name of the point"), self._record)

    def _record(self, point: str | None) -> None:
        console = self._console
        if point is not None:
            console.point = point
            elements = [recorded_as(console.hands.element)]
            console.ask(lambda client: record(client, point, elements), self._recorded)

    def _recorded(self, entry: Entry | None) -> None:
        console = self._console
        if entry is not None:
            console.entries = (*console.entries, entry)
            console.say(f"recorded {entry.number}: {entry.point}")
            console.refresh_panels()

    def do_strike(self) -> None:
        """Strike the last reading out that is not struck yet, once all that was ordered before is in the book."""
        self._console.afterwards(self._strike_last)

    def _strike_last(self) -> None:
        console = self._console
        last = next((entry for entry in reversed(console.entries) if not entry.struck), None)
        if last is None:
            console.say("there is nothing in the book to strike out")
            return
        console.station.say(f"REC:STR {last.number},{quoted(WHY)}")
        console.entries = tuple(entry.struck_out() if entry is last else entry for entry in console.entries)
        console.say(f"struck out {last.number}: {last.point}")
        console.refresh_panels()

    def do_note(self) -> None:
        """Write a remark into the journal."""
        console = self._console

        def noted(text: str | None) -> None:
            if text is not None:
                console.station.say(f"NOTE {quoted(text)}")
                console.say(f"noted: {text}")

        console.push_screen(Ask("note"), noted)

    # --- eyes and screen ------------------------------------------------------------------------------

    def do_magnify(self) -> None:
        """Magnify more."""
        self._magnify(1)

    def do_reduce(self) -> None:
        """Magnify less."""
        self._magnify(-1)

    def _magnify(self, way: int) -> None:
        console = self._console
        at = MAGNIFICATIONS.index(console.view.magnification) + way
        console.set_view(magnification=MAGNIFICATIONS[min(max(at, 0), len(MAGNIFICATIONS) - 1)])

    def do_eyes(self) -> None:
        """Open both eyes, the left, the right."""
        console = self._console
        console.set_view(eyes=_next(EYES, console.view.eyes))

    def do_merge(self) -> None:
        """See side by side, as an anaglyph, or in turns."""
        console = self._console
        console.set_view(merged=_next(MERGED, console.view.merged))
        console.say(console.view.merged)

    def do_drawing(self) -> None:
        """Draw the pictures another way."""
        console = self._console
        ways = tuple(Drawing) if console.utf8 else (Drawing.ASCII, Drawing.WORDS)
        console.set_view(drawing=_next(ways, console.view.drawing))
        console.say(f"eyepieces in {console.view.drawing}")

    def do_panel(self) -> None:
        """Show the next panel at the right of a narrow screen."""
        self._console.next_panel()

    def do_help(self) -> None:
        """Show all keys."""
        console = self._console
        console.push_screen(HelpPage(console.seat.keymap, not console.utf8))

    def do_quit(self) -> None:
        """Leave; everything is in the book and the journal."""
        self._console.exit()


def _next(ways: tuple[Any, ...], at: Any) -> Any:
    return ways[(ways.index(at) + 1) % len(ways)]
