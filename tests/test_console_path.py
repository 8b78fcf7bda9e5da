"""The console on a real terminal: a person's path, who knows nothing but what stands on the screen."""

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
"""What clears a mm of x-parallax by Z and a mm of y-parallax by by', from the projection height and c."""


@needs_tmux
def test_real_keys_in_a_real_terminal(tmp_path: Path) -> None:
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
class Seen:
    """What a person reads from the screen in words, by the drums and the message."""

    by: Decimal
    z: Decimal
    x_parallax: Decimal
    """mm at photo scale."""
    y_parallax: Decimal
    """mm at photo scale, the left image higher."""

    @classmethod
    def read(cls, screen: str) -> "Seen | None":
        said = re.search(
            r"^ \w+: (?:no y-parallax|left image is about ([\d.]+) (um|mm) (higher|lower)), "
            r"(?:no x-parallax|x-parallax about (-?[\d.]+) (um|mm))$",
            "\n".join(line.rstrip() for line in screen.splitlines()),
            re.MULTILINE,
        )
        by, drums = re.search(r"│by +>? *(-?[\d.]+)", screen), re.search(r"─ Z ─.*\n(.*)", screen)
        if said is None or by is None or drums is None:
            return None
        up, up_unit, way, across, across_unit = said.groups()
        z = drums[1].split("│")[5].replace(" ", "")
        return cls(
            Decimal(by[1]),
            Decimal(z),
            _mm(across, across_unit),
            _mm(up, up_unit) * (-1 if way == "lower" else 1),
        )


def _mm(number: str | None, unit: str) -> Decimal:
    return Decimal(number or 0) * (Decimal("0.001") if unit == "um" else 1)


class Observer:
    """A person who clears parallaxes: keys in, words read."""

    def __init__(self, terminal: Terminal) -> None:
        self.terminal = terminal
        self.rung = STEP_SIZES.index(1.0)

    def turn(self, amount: Decimal, finest: float, forward: str, back: str) -> Decimal:
        """Turn by the rungs of the ladder as many steps as come nearest to an amount; return how much was turned."""
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

    def looked(self, by: Decimal, z: Decimal) -> Seen:
        """Look until the drums stand where they were turned to and the words are there; twice the same is seen."""
        last: list[Seen] = []

        def standing(screen: str) -> Seen | None:
            seen = Seen.read(screen)
            if seen is None or (seen.by, seen.z) != (by, z):
                return None
            last.append(seen)
            return seen if last[-8:] == [seen] * 8 else None

        return self.terminal.sees(standing, f"by' at {by} and Z at {z}")

    def clear(self, by: Decimal, z: Decimal) -> Seen:
        """Turn Z and by' until there is no parallax to be seen."""
        seen = self.looked(by, z)
        for _ in range(12):
            if not seen.x_parallax and not seen.y_parallax:
                return seen
            z += self.turn(seen.x_parallax * Z_PER_PARALLAX, 0.01, "PPage", "NPage")
            by += self.turn(seen.y_parallax * BY_PER_PARALLAX, 0.01, "+", "-")
            seen = self.looked(by, z)
        raise AssertionError(f"parallaxes do not vanish: {seen}")


@needs_tmux
@pytest.mark.slow
def test_a_person_clears_six_points_with_real_keys_and_the_book_is_what_the_same_lines_give(tmp_path: Path) -> None:
    heard: list[LinkEvent] = []
    with ServerThread(with_photographs(heard.append).instrument) as served:
        url = f"tcp://127.0.0.1:{served.port}"
        with Terminal(tmp_path, "console", "akwanga", "--connect", url, "--plain") as terminal:
            book = oriented_by_eye(terminal)
            terminal.press("q")
            assert "Traceback" not in terminal.shows("left 0")
    assert [line[0] for line in book] == list(POINTS)
    assert len({by for *_, by in book}) == len(POINTS)
    assert book == recorded_by_the_same_lines(heard)


def oriented_by_eye(terminal: Terminal) -> list[tuple[str, ...]]:
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


def recorded_by_the_same_lines(heard: list[LinkEvent]) -> list[tuple[str, ...]]:
    """Say what a console said to another instrument over TCP; every reply is the same. Return its registrations."""
    said = [event for event in heard if event.direction in "<>" and "PICT" not in event.text]
    recorded = []
    with ServerThread(with_photographs().instrument) as served:
        line = served.line()
        replies = iter([event.text for event in said if event.direction == "<"])
        for event in said:
            if event.direction == ">" and "?" in event.text:
                reply = line.ask(event.text)
                assert reply == next(replies)
                if "REC:LAST?" in event.text:
                    _, point, x, y, z, _, by = reply.split(",")
                    recorded.append((point.strip('"'), x, y, z, by))
            elif event.direction == ">":
                line.send(event.text.encode() + b"\n")
    return recorded
