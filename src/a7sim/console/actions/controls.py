"""Actions of the controls: turning wheels and drums, and driving them to typed readings."""

from dataclasses import replace

from a7sim.console.actions.base import ActionBase
from a7sim.console.state.selection import element_label, unit
from a7sim.link.client.client import Client
from a7sim.link.headers import header


class ControlActions(ActionBase):
    """Actions of the controls."""

    def move(self, axis: str, way: int) -> None:
        """Turn a handwheel or the foot disc by a step."""
        console = self._console
        selection = console.selection

        def order(client: Client) -> None:
            reading = float(client.ask(f"COUN:{axis}?")) if selection.free and axis != "Z" else 0.0
            client.send(selection.moved(axis, way, reading))

        console.thread.submit(order)

    def take_up(self, name: str) -> None:
        """Select an element, if the plotter has it."""
        console = self._console
        variant, _ = self._at()
        taken = replace(console.selection, name=name)
        if taken.element not in variant.elements:
            console.say(f"an {variant.name} has no {name.replace('_', ' ')}", refused=True)
            return
        self._hold(taken)

    def do_left_side(self) -> None:
        """Select the left projector's element."""
        self._hold(replace(self._console.selection, side=1))

    def do_right_side(self) -> None:
        """Select the right projector's element."""
        self._hold(replace(self._console.selection, side=2))

    def do_finer(self) -> None:
        """Make the step smaller."""
        self._hold(self._console.selection.stepping(-1))

    def do_coarser(self) -> None:
        """Make the step larger."""
        self._hold(self._console.selection.stepping(1))

    def do_turn_up(self) -> None:
        """Turn the selected element forward."""
        self._console.thread.send(self._console.selection.turned(1))

    def do_turn_down(self) -> None:
        """Turn the selected element back."""
        self._console.thread.send(self._console.selection.turned(-1))

    def wheel(self, drum: str, way: int) -> None:
        """Turn the drum under the mouse and select its element."""
        console = self._console
        if console.dials is None:
            return
        if drum in ("X", "Y", "Z"):
            self.move(drum, way)
            return
        bare = drum in ("bx", "common_phi")
        self._hold(
            replace(
                console.selection,
                name=drum if bare else drum[:-1],
                side=console.selection.side if bare else int(drum[-1]),
            )
        )
        if way:
            console.thread.send(console.selection.turned(way))

    def do_free_hand(self) -> None:
        """Disengage X and Y from the wheels, or engage them again."""
        console = self._console
        free = not console.selection.free
        self._hold(replace(console.selection, free=free))
        console.say(
            "free hand: X and Y move without the wheels; click a place to bring it under the mark"
            if free
            else "hands at the wheels"
        )

    def clicked(self, across: int, up: int) -> None:
        """In free hand, move a position of the left eyepiece's picture under the mark."""
        console = self._console
        sight, selection = console.sight, console.selection
        if not selection.free or sight is None or not sight.look.columns:
            return
        variant, dials = self._at()
        look = sight.look
        pitch = 2.0 * variant.field_radius_mm / (look.magnification * max(look.columns, look.rows))
        height = abs(console.presets.frame(variant, dials)[2])
        scale = pitch * height / dials.element("c1")
        dx, dy = across * scale, 2 * up * scale
        x, y = (console.presets.unit(variant, axis) * each for axis, each in (("X", dx), ("Y", dy)))
        console.thread.send(f"DRIV:X {dials.counter('X') + x:.2f};Y {dials.counter('Y') + y:.2f}")

    def do_set(self) -> None:
        """Set the selected element to a reading."""
        console = self._console
        variant, dials = self._at()
        element = console.selection.element
        data = variant.elements[element]
        note = f"{data.low:g} to {data.high:g} {unit(variant, element)}; it stands at {dials.elements[element]}"
        self._ask_number(
            f"set {element_label(element)} to", note, lambda value: console.thread.send(f"{header(element)} {value:g}")
        )

    def do_drive(self) -> None:
        """Drive carriages to readings."""
        self._ask_axes("run to readings", "such as: X 97.5 Y -12 Z -325.71", self._drive)

    def _drive(self, readings: list[tuple[str, str]]) -> None:
        self._console.thread.send(*(f"DRIV:{axis} {reading}" for axis, reading in readings))
