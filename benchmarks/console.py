"""Time the console: a frame, from key to new frame, first paint, CPU while turning; beside a bare Textual widget.

    python benchmarks/console.py [COLUMNS ROWS]

The last three are measured on a pseudo-terminal with the program as people start it. The floor is a widget of the
same size that draws noise in half-blocks at every key.
"""

import os
import pty
import select
import signal
import statistics
import struct
import sys
import termios
import time
from collections.abc import Callable
from fcntl import ioctl
from pathlib import Path

import numpy as np
from figures import Figure, Target, tell

FLOOR = "--floor"
KEYS = (b"\x1b[C", b"\x1b[D")
QUIET_S = 0.12


def timed(work: Callable[[], object], times: int = 40) -> float:
    """Return the median of `times` runs, ms."""
    taken = []
    for _ in range(times):
        began = time.perf_counter()
        work()
        taken.append(1e3 * (time.perf_counter() - began))
    return statistics.median(taken)


def frame_times(columns: int, rows: int) -> tuple[float, float]:
    """Return ms to render both eyes' pictures over the language, and to draw them in half-blocks."""
    from a7sim.console.drawing.rasterize import apply_vignette, half_blocks, overlay_mark
    from a7sim.link.client.client import Client

    with Client.open("a7sim://akwanga?seed=7") as client:
        client.send('PHOT1:LOAD "101";:PHOT2:LOAD "102";:BASE:BX 194.99;:DRIV:X 97;Z -320')
        ask = f"PICT? {columns},{rows},8"
        rendered = timed(lambda: [client.block(f"EYEP{eye}:{ask}") for eye in (1, 2)])
        block = np.frombuffer(client.block(f"EYEP1:{ask}"), dtype=np.uint8).reshape(rows, columns)
    drawn = timed(lambda: [overlay_mark(half_blocks(apply_vignette(block)), "o") for _ in (1, 2)])
    return rendered, drawn


class Terminal:
    """Program on a pseudo-terminal."""

    def __init__(self, command: list[str], columns: int, rows: int) -> None:
        self.began = time.perf_counter()
        self.pid, self.fd = pty.fork()
        if self.pid == 0:
            os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
            os.environ.update(TERM="xterm-256color", COLORTERM="truecolor", LC_ALL="C.UTF-8")
            os.execv(command[0], command)
        ioctl(self.fd, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def read(self, seconds: float) -> bytes:
        """Return the available bytes, waiting up to a limit for the first."""
        ready, _, _ = select.select([self.fd], [], [], seconds)
        try:
            return os.read(self.fd, 1 << 16) if ready else b""
        except OSError:
            return b""

    def until(self, words: bytes, seconds: float = 20.0) -> float:
        """Return the seconds from the start until words are on the screen."""
        come = b""
        while words not in come:
            if time.perf_counter() - self.began > seconds:
                raise SystemExit(f"expected {words!r} within {seconds:g} s, got {come[-300:]!r}")
            come += self.read(0.5)
        return time.perf_counter() - self.began

    def drained(self, seconds: float) -> int:
        """Return the number of bytes received within a time."""
        end, size = time.perf_counter() + seconds, 0
        while (left := end - time.perf_counter()) > 0:
            size += len(self.read(left))
        return size

    def send(self, keys: bytes) -> None:
        os.write(self.fd, keys)

    def key_to_frame(self, key: bytes, least: int) -> float:
        """Return ms from a key until a frame of at least `least` bytes is complete."""
        self.drained(0.2)
        began = last = time.perf_counter()
        self.send(key)
        size = 0
        while time.perf_counter() - last < QUIET_S or size < least:
            come = self.read(QUIET_S)
            if come and size < least:
                size += len(come)
                last = time.perf_counter()
            if time.perf_counter() - began > 5.0:
                raise SystemExit(f"no frame after a key, only {size} bytes")
        return 1e3 * (last - began)

    def cpu(self) -> float:
        """Return the CPU time used so far, s."""
        fields = Path(f"/proc/{self.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def share_while_turning(self, a_second: int, seconds: float) -> tuple[float, float]:
        """Return the share of a core and the kilobytes per second drawn at a rate of key presses per second."""
        before, began, size, pressed = self.cpu(), time.perf_counter(), 0, 0
        while (now := time.perf_counter() - began) < seconds:
            if now * a_second >= pressed:
                self.send(KEYS[pressed // 10 % 2])
                pressed += 1
            size += len(self.read(max(0.0, pressed / a_second - (time.perf_counter() - began))))
        return (self.cpu() - before) / seconds, size / seconds / 1e3

    def end(self) -> None:
        os.kill(self.pid, signal.SIGKILL)
        os.waitpid(self.pid, 0)
        os.close(self.fd)


def floor_app(columns: int, rows: int) -> None:
    """Run a bare widget that draws noise at each key."""
    from rich.color import Color
    from rich.segment import Segment
    from rich.style import Style
    from textual.app import App, ComposeResult
    from textual.events import Key
    from textual.strip import Strip
    from textual.widget import Widget

    styles = [
        [Style(color=Color.from_rgb(i, i, i), bgcolor=Color.from_rgb(j, j, j)) for i in range(0, 256, 8)]
        for j in range(0, 256, 8)
    ]
    noise = np.random.default_rng(0)

    class Noise(Widget):
        DEFAULT_CSS = "Noise { width: 100%; height: 100%; }"
        grey = noise.integers(0, 32, (2 * rows, columns))

        def render_line(self, y: int) -> Strip:
            if y >= rows:
                return Strip.blank(columns)
            upper, lower = self.grey[2 * y].tolist(), self.grey[2 * y + 1].tolist()
            return Strip([Segment("▀", styles[j][i]) for i, j in zip(upper, lower, strict=True)], columns)

    class Floor(App[None]):
        def compose(self) -> ComposeResult:
            yield Noise()

        def on_key(self, event: Key) -> None:
            widget = self.query_one(Noise)
            widget.grey = noise.integers(0, 32, (2 * rows, columns))
            widget.refresh()

    Floor().run()


def first_paint(command: list[str], columns: int, rows: int, awaited: bytes, times: int = 5) -> tuple[float, float]:
    """Return the shortest time of several starts to the first paint, and the least CPU time of one, s.

    A start before them compiles the byte code, as the first start of an installed console does.
    """
    taken = []
    for _ in range(times + 1):
        terminal = Terminal(command, columns, rows)
        taken.append((terminal.until(awaited), terminal.cpu()))
        terminal.end()
    wall, cpu = zip(*taken[1:], strict=True)
    return min(wall), min(cpu)


def measured(
    command: list[str], columns: int, rows: int, awaited: bytes, load: bool
) -> tuple[float, float, float, float, float, int]:
    """Return first paint s, its CPU s, key to frame ms, CPU share at 20 keys/s, kB/s, and bytes drawn in 3 idle s."""
    paint, spent = first_paint(command, columns, rows, awaited)
    terminal = Terminal(command, columns, rows)
    terminal.until(awaited)
    terminal.drained(1.5)
    if load:
        for line in ('PHOT1:LOAD "101";:PHOT2:LOAD "102"', "BASE:BX 194.99;:DRIV:X 97;Z -320"):
            terminal.send(b":")
            terminal.drained(0.5)
            terminal.send(line.encode() + b"\r")
            terminal.drained(1.0)
    frame = statistics.median(terminal.key_to_frame(KEYS[i % 2], 400) for i in range(20))
    share, kilobytes = terminal.share_while_turning(20, 5.0)
    terminal.drained(1.0)
    idle = terminal.drained(3.0)
    terminal.end()
    return paint, spent, frame, share, kilobytes, idle


def asked_of(name: str, console: tuple[float, ...], floor: tuple[float, ...]) -> list[Figure]:
    """Return the console's figures compared with the bare widget's."""
    against = "bare Textual widget"
    row = (
        ("first paint", "s", 1.0, Target("below", 0.8)),
        ("CPU until first paint", "s", 1.0, None),
        ("key to frame", "ms", 1.0, Target("below", 60)),
        ("CPU at 20 keys a second", "% of a core", 100.0, Target("below", 50)),
        ("drawn at 20 keys a second", "kB/s", 1.0, None),
    )
    figures = [
        Figure(f"{name}, {what}", scale * ours, unit, against, ours / bare if bare else None, target)
        for (what, unit, scale, target), ours, bare in zip(row, console, floor, strict=False)
    ]
    return [*figures, Figure(f"{name}, drawn in 3 idle s", console[-1], "bytes", target=Target("at most", 0))]


def main() -> list[Figure]:
    sizes = [int(each) for each in sys.argv[1:] if each.isdigit()] or [100, 30]
    columns, rows = sizes[0], sizes[1]
    if FLOOR in sys.argv:
        floor_app(columns, rows)
        return []
    figures = []
    print("frame of both eyes over the language, and drawn in half-blocks:")
    for across, down in ((25, 22), (29, 26), (53, 50)):
        rendered, drawn = frame_times(across, down)
        print(f"  {across:>3} x {down:<3} rendered {rendered:6.2f} ms   drawn {drawn:5.2f} ms")
        figures.append(Figure(f"frame of both eyes, {across} x {down}", rendered, "ms", target=Target("below", 8)))
    console = [sys.executable, "-m", "a7sim", "console", "akwanga", "--seed", "7", "--theme", "enamel"]
    floor = [sys.executable, __file__, FLOOR, str(2 * 29), "13"]
    print(f"{'':<22}first paint   its CPU   key to frame   CPU at 20/s     drawn    idle 3 s")
    seen = []
    for name, command, awaited, load in (
        ("console", console, b"elements", True),
        ("bare Textual widget", floor, "▀".encode(), False),
    ):
        paint, spent, frame, share, kilobytes, idle = numbers = measured(command, columns, rows, awaited, load)
        row = f"{paint:9.2f} s {spent:7.2f} s {frame:11.0f} ms {share:11.0%} {kilobytes:7.0f} kB/s {idle:7d} B"
        print(f"  {name:<20}{row}")
        seen.append(numbers)
    return figures + asked_of(f"{columns} x {rows}", *seen)


if __name__ == "__main__":
    tell(main)
