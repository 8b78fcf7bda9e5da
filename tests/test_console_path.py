"""The console on a real terminal: the work of a person from the text on the screen alone."""

import re
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import pytest

from a7sim.console.state.selection import STEP_SIZES
from a7sim.instrument.language import LinkEvent
from tests.support.engine_client import with_photographs
from tests.support.server_thread import ServerThread
from tests.support.tmux import Terminal, needs_tmux

POINTS = ("1021", "1011", "1023", "1013", "1025", "1015")

Z_PER_PARALLAX, BY_PER_PARALLAX = Decimal("3.55"), Decimal("2.08")
"""The Z that clears 1 mm of x-parallax and the by' that clears 1 mm of y-parallax, from projection height and c."""


@needs_tmux
def test_the_console_reacts_to_real_keys_in_a_real_terminal(tmp_path: Path) -> None:
    with Terminal(tmp_path, "console", "akwanga", "--seed", "7") as terminal:
        assert "Two eyes, one ground" in terminal.shows("l lays pictures; ? is help")
        terminal.press("l")
        terminal.choose("bench", "left projector: lay")
        terminal.choose("lay in the left projector", "101")
        screen = terminal.shows("sketch 101")
        assert "Two eyes" not in screen, "the welcome goes with the first key"
        assert "▀" in screen
        terminal.press("Right", "Right", "NPage")
        terminal.shows("- 3 0 1 . 0 0")
        terminal.shows("  2 . 0 0")
        terminal.resize(80, 24)
        terminal.press("q")
        assert "Traceback" not in terminal.shows("left 0")


@dataclass
class Readout:
    """Values that a person reads from the drums and the message on the screen."""

    by: Decimal
    z: Decimal
    x_parallax: Decimal
    """mm at photo scale."""
    y_parallax: Decimal
    """mm at photo scale, the left image higher."""

    @classmethod
    def read(cls, screen: str) -> "Readout | None":
        words = re.search(
            r"^ \w+: (?:no y-parallax|left image is about ([\d.]+) (um|mm) (higher|lower)), "
            r"(?:no x-parallax|x-parallax about (-?[\d.]+) (um|mm))$",
            "\n".join(line.rstrip() for line in screen.splitlines()),
            re.MULTILINE,
        )
        by, drums = re.search(r"│by +>? *(-?[\d.]+)", screen), re.search(r"─ Z ─.*\n(.*)", screen)
        if words is None or by is None or drums is None:
            return None
        up, up_unit, direction, across, across_unit = words.groups()
        z = drums[1].split("│")[5].replace(" ", "")
        return cls(
            Decimal(by[1]),
            Decimal(z),
            _mm(across, across_unit),
            _mm(up, up_unit) * (-1 if direction == "lower" else 1),
        )


def _mm(number: str | None, unit: str) -> Decimal:
    return Decimal(number or 0) * (Decimal("0.001") if unit == "um" else 1)


class Observer:
    """A person that clears parallaxes with keys by the words on the screen."""

    def __init__(self, terminal: Terminal) -> None:
        self.terminal = terminal
        self.rung = STEP_SIZES.index(1.0)

    def turn(self, amount: Decimal, finest: float, forward: str, back: str) -> Decimal:
        """Turn by whole steps of each size to the value nearest to `amount`; return the turned amount."""
        left, keys = abs(amount), list[str]()
        for rung in reversed(range(STEP_SIZES.index(finest), len(STEP_SIZES))):
            step = Decimal(str(STEP_SIZES[rung]))
            times = int(left / step + (Decimal("0.5") if STEP_SIZES[rung] == finest else 0))
            if times:
                keys += ["]" if rung > self.rung else "["] * abs(rung - self.rung)
                keys += [forward if amount > 0 else back] * times
                self.rung, left = rung, left - times * step
        if keys:
            self.terminal.press(*keys)
        return (abs(amount) - left) * (1 if amount > 0 else -1)

    def look(self, by: Decimal, z: Decimal) -> Readout:
        """Wait until the drums show `by` and `z` and the readout no longer changes; return the readout."""
        last: list[Readout] = []

        def steady(screen: str) -> Readout | None:
            seen = Readout.read(screen)
            if seen is None or (seen.by, seen.z) != (by, z):
                return None
            last.append(seen)
            return seen if last[-8:] == [seen] * 8 else None

        return self.terminal.sees(steady, f"by' at {by} and Z at {z}")

    def clear(self, by: Decimal, z: Decimal) -> Readout:
        """Turn Z and by' until no parallax is visible."""
        seen = self.look(by, z)
        for _ in range(12):
            if not seen.x_parallax and not seen.y_parallax:
                return seen
            z += self.turn(seen.x_parallax * Z_PER_PARALLAX, 0.01, "PPage", "NPage")
            by += self.turn(seen.y_parallax * BY_PER_PARALLAX, 0.01, "+", "-")
            seen = self.look(by, z)
        raise AssertionError(f"parallaxes do not vanish: {seen}")


@needs_tmux
@pytest.mark.slow
def test_points_cleared_with_real_keys_are_recorded_as_by_the_same_lines_over_a_link(tmp_path: Path) -> None:
    events: list[LinkEvent] = []
    with ServerThread(with_photographs(events.append).instrument) as served:
        url = f"tcp://127.0.0.1:{served.port}"
        with Terminal(tmp_path, "console", "akwanga", "--connect", url, "--plain") as terminal:
            book = orient_by_eye(terminal)
            terminal.press("q")
            assert "Traceback" not in terminal.shows("left 0")
    assert [line[0] for line in book] == list(POINTS)
    assert len({by for *_, by in book}) == len(POINTS)
    assert book == registrations_of_replay(events)


def orient_by_eye(terminal: Terminal) -> list[tuple[str, ...]]:
    """Lay, centre, set c, clear and record six points; return the book as the screen shows it."""
    terminal.shows("l lays pictures; ? is help")
    for side, picture in (("left", "101"), ("right", "102")):
        terminal.press("l")
        terminal.choose("bench", f"{side} projector: lay")
        terminal.choose(f"lay in the {side} projector", picture)
        terminal.shows(f"sketch {picture}")
        terminal.press("l")
        terminal.choose("bench", f"{side} projector: centre")
        terminal.shows("with the film's shrinkage c is 152.")
        terminal.press("l")
        terminal.choose("bench", "c' to 152." if side == "left" else 'c" to 152.')
    terminal.press("b", "s")
    terminal.shows("set bx to")
    terminal.type_in("194.99")
    terminal.shows(">194.99")
    terminal.press("d")
    terminal.shows("run to readings")
    terminal.type_in("Z -317.5")
    terminal.shows("- 3 1 7 . 5 0")
    terminal.press("y")
    observer = Observer(terminal)
    by, z = Decimal("0.00"), Decimal("-317.50")
    for number, point in enumerate(POINTS, start=1):
        terminal.press("g")
        terminal.choose("drive near a point", point)
        terminal.shows(f" {point}: ")
        seen = observer.clear(by, z)
        by, z = seen.by, seen.z
        terminal.press("Enter")
        terminal.shows(f"│   {number} {point} ")
    line = r"│ +\d+ (\w+) +(-?[\d.]+) +(-?[\d.]+) +(-?[\d.]+) +by' (-?[\d.]+) *│$"
    return re.findall(line, terminal.screen(), re.MULTILINE)


def registrations_of_replay(events: list[LinkEvent]) -> list[tuple[str, ...]]:
    """Replay the lines of a console on another instrument over TCP, require equal replies, return the registrations."""
    exchanged = [event for event in events if event.direction in "<>" and "PICT" not in event.text]
    recorded = []
    with ServerThread(with_photographs().instrument) as served:
        line = served.line()
        replies = iter([event.text for event in exchanged if event.direction == "<"])
        for event in exchanged:
            if event.direction == ">" and "?" in event.text:
                reply = line.ask(event.text)
                assert reply == next(replies)
                if "REC:LAST?" in event.text:
                    _, point, x, y, z, _, by = reply.split(",")
                    recorded.append((point.strip('"'), x, y, z, by))
            elif event.direction == ">":
                line.send(event.text.encode() + b"\n")
    return recorded
