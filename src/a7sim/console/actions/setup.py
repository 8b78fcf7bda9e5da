"""Setup actions, chosen from a list: pictures, fittings, gears, presets."""

from collections.abc import Callable
from functools import partial
from typing import Any

from a7sim.console.actions.base import PROJECTORS, ActionBase
from a7sim.console.drawing.job_sheet import CentringResult, centre_picture
from a7sim.console.state.selection import element_label
from a7sim.console.widgets.dialogs import Ask, Choose
from a7sim.console.widgets.panels import FITTING_ROWS
from a7sim.link.headers import FITTING_NODES, quote_text, short_form
from a7sim.plotters import POSITIONS_OF


class SetupActions(ActionBase):
    """Actions of the setup."""

    def do_bench(self) -> None:
        """Offer all setup actions."""
        self._console.ask(lambda client: client.fields("PHOT:CAT?"), self._bench)

    def _bench(self, catalogue: list[str]) -> None:
        variant, dials = self._at()
        console = self._console
        choices: list[tuple[str, Callable[[], Any]]] = []
        for projector, picture in enumerate(dials.pictures, start=1):
            side = PROJECTORS[projector]
            choices.append(
                (f"{side} projector: lay a picture ({picture or 'empty'})", partial(self._lay, projector, catalogue))
            )
            if picture:
                choices.append((f"{side} projector: centre {picture}", partial(self._centre, projector)))
                choices.append(
                    (f"{side} projector: take {picture} off", partial(console.thread.send, f"PHOT{projector}:UNL"))
                )
            if projector in console.principal_distances:
                c = console.principal_distances[projector]
                words = f"{element_label(f'c{projector}')} to {c:.2f}, by certificate and film"
                choices.append((words, partial(console.thread.send, f"PROJ{projector}:PDIS {c:.2f}")))
        choices += [self._lever(name, at) for name, at in dials.fittings.items()]
        if len(variant.base_modes) > 1:
            other = next(mode for mode in variant.base_modes if mode != dials.base)
            choices.append(
                (f"base {dials.base}: put it {other}", partial(console.thread.send, f"BASE:MODE {short_form(other)}"))
            )
        choices.append((f"height gear {dials.height_gear}: another", self._height_gear))
        choices.append((f"plan gear {dials.plan_gear}: another", self._plan_gear))
        choices.append(
            (
                "preset counters",
                partial(self._ask_axes, "make counters show", "such as: X 5000 Y 5000 Z 4967", self._preset),
            )
        )
        choices.append(("all elements to their zeros (*RST)", self._reset))
        self._offer("bench", choices)

    def _offer(self, question: str, choices: list[tuple[str, Callable[[], Any]]]) -> None:
        def chosen(number: str | None) -> None:
            if number is not None:
                choices[int(number.removeprefix("n"))][1]()

        listed = [(f"n{number}", words) for number, (words, _) in enumerate(choices)]
        self._console.push_screen(Choose(question, listed), chosen)

    def _lay(self, projector: int, catalogue: list[str]) -> None:
        console = self._console

        def chosen(name: str | None) -> None:
            if name is not None:
                console.principal_distances.pop(projector, None)
                console.thread.send(f"PHOT{projector}:LOAD {quote_text(catalogue[int(name.removeprefix('n'))])}")

        listed = [(f"n{number}", name) for number, name in enumerate(catalogue)]
        console.push_screen(Choose(f"lay in the {PROJECTORS[projector]} projector", listed), chosen)

    def _centre(self, projector: int) -> None:
        console = self._console

        def centred(lie: CentringResult) -> None:
            if lie.principal_distance is not None:
                console.principal_distances[projector] = lie.principal_distance
            console.say(f"{PROJECTORS[projector]} picture: {lie.words}")

        console.ask(lambda client: centre_picture(client, projector, console.config.sheet), centred)

    def _lever(self, name: str, at: str) -> tuple[str, Callable[[], Any]]:
        other = next(position for position in POSITIONS_OF[name] if position != at)
        line = f"FITT:{FITTING_NODES[name]} {short_form(other)}"
        return f"{FITTING_ROWS[name]} {at}: put it {other}", partial(self._console.thread.send, line)

    def _height_gear(self) -> None:
        variant, _ = self._at()
        note = f"{', '.join(variant.height_gears)} or units a mm"
        self._console.push_screen(Ask("height gear", note=note), self._gear_in)

    def _gear_in(self, gear: str | None) -> None:
        console = self._console
        if gear is None:
            return
        variant, dials = self._at()
        known = variant.height_gears.get(gear)
        try:
            units = known.units_per_mm if known else float(gear)
        except ValueError:
            console.say(
                f"height gear: expected {', '.join(variant.height_gears)} or a number, got {gear!r}", refused=True
            )
            return
        console.presets.regeared(variant, dials, units)
        console.thread.send(f"GEAR:HEIG {quote_text(gear) if known else gear}")

    def _plan_gear(self) -> None:
        console = self._console

        def chosen(gear: str | None) -> None:
            if gear is not None:
                console.thread.send(f"GEAR:PLAN {quote_text(gear)}")

        console.push_screen(Ask("plan gear", note="such as 1-2-1"), chosen)

    def _preset(self, readings: list[tuple[str, str]]) -> None:
        console = self._console
        variant, dials = self._at()
        for axis, reading in readings:
            console.presets.preset(variant, dials, axis, float(reading))
            console.thread.send(f"COUN:{axis}:PRES {reading}")

    def _reset(self) -> None:
        self._console.presets.origins.clear()
        self._console.thread.send("*RST")
