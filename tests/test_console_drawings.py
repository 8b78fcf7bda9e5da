"""Drawing functions of the console: eyepieces, drums, sketches, words and the keymap."""

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from a7sim.cli import main
from a7sim.console.config import best_drawing, speaks_utf8
from a7sim.console.drawing import rasterize
from a7sim.console.drawing.descriptions import describe_image, describe_parallax
from a7sim.console.drawing.drums import ROLLING_FRAMES, bar, rolling_frame
from a7sim.console.drawing.rasterize import DrawingMode, Run
from a7sim.console.drawing.sketch import draw_points, overlay_mark
from a7sim.console.keymap import actions_for, default_keymap, key_name, load_keymap, sample
from a7sim.console.state.selection import STEP_SIZES, ControlSelection
from a7sim.errors import A7SimError
from a7sim.plotters import VARIANTS

STAIRS = np.array([[0, 7, 8, 255], [0, 8, 8, 0]], dtype=np.uint8)
"""Two rows of pixels: one row of cells."""


def text(rows: list[list[Run]]) -> list[str]:
    return ["".join(run.text for run in row) for row in rows]


def test_half_blocks_show_two_pixels_a_cell_at_32_greys() -> None:
    assert rasterize.half_blocks(STAIRS) == [
        [Run(" ", 0, 0), Run("▀", 0, 1), Run(" ", 1, 1), Run("▀", 31, 0)],
    ]


def test_equal_neighbouring_cells_are_one_run() -> None:
    assert rasterize.half_blocks(np.full((2, 9), 128, dtype=np.uint8)) == [[Run(" " * 9, 16, 16)]]


def test_shades_and_ascii_go_from_dark_to_light() -> None:
    ramp = np.tile(np.linspace(0, 255, 64).astype(np.uint8), (2, 1))
    assert text(rasterize.shades(ramp))[0].startswith("   ") and text(rasterize.shades(ramp))[0].endswith("█")
    steps = [" .:-=+*#%@".index(each) for each in text(rasterize.ascii_shades(ramp))[0]]
    assert max(np.diff(steps)) <= 2 and steps[0] == 0 and steps[-1] >= 8


def test_braille_lights_the_dots_of_the_pixels() -> None:
    dots = np.zeros((4, 4), dtype=np.uint8)
    dots[0, 0] = dots[3, 3] = 255
    assert text(rasterize.braille(dots)) == ["\u2801\u2880"]


@given(st.integers(1, 90), st.integers(1, 50))
def test_the_mark_is_in_the_middle_cell(width: int, height: int) -> None:
    columns, rows = rasterize.window(width, height)
    assert columns % 2 and rows % 2 and width - columns <= 1 and height - rows <= 1
    across, down = rasterize.picture_size(DrawingMode.HALVES, columns, rows)
    shown = rasterize.overlay_mark(rasterize.half_blocks(np.zeros((down, across), dtype=np.uint8)), "o")
    assert text(shown)[rows // 2] == " " * (columns // 2) + "o" + " " * (columns // 2)
    assert sum(run.ink == rasterize.MARK for row in shown for run in row) == 1


def test_an_anaglyph_contains_both_eyes() -> None:
    left, right = np.full((2, 1), 255, dtype=np.uint8), np.zeros((2, 1), dtype=np.uint8)
    assert rasterize.anaglyph(left, right) == [[Run(" ", 240, 240)]]
    assert rasterize.anaglyph(right, left) == [[Run(" ", 15, 15)]]


def test_the_optics_darken_the_corners_alone() -> None:
    seen = rasterize.apply_vignette(np.full((31, 31), 200, dtype=np.uint8))
    assert seen[15, 15] == 200 and seen[0, 0] < 120 and seen[0, 0] == seen[30, 30]


@given(st.integers(0, 99999), st.integers(0, 99999))
def test_a_rolling_digit_passes_its_neighbours_and_ends_at_its_value(before: int, after: int) -> None:
    old, new = f"{before:08.2f}", f"{after:08.2f}"
    assert rolling_frame(old, new, 0) == old
    assert rolling_frame(old, new, ROLLING_FRAMES) == new
    for a, b, between in zip(old, new, rolling_frame(old, new, 1), strict=True):
        if a.isdigit():
            distances = {(int(between) - int(a)) % 10, (int(a) - int(between)) % 10}
            assert min(distances) <= 2, f"{a} to {b} by {between}"


def test_a_bar_shows_the_position_of_an_element() -> None:
    assert bar(-50.0, -50.0, 50.0, 5) == "┃────"
    assert bar(0.0, -50.0, 50.0, 5) == "──┃──"
    assert bar(70.0, -50.0, 50.0, 5, "-", "|") == "----|"


def test_a_sketch_shows_points_names_and_the_mark() -> None:
    drawn = overlay_mark(draw_points({"1011": (-80.0, 0.0), "C1": (80.0, 80.0)}, 25, 7), (0.0, -80.0), 25, 7)
    assert drawn.rows == [
        "                         ",
        "                    ·C1  ",
        "                         ",
        "    ·1011                ",
        "                         ",
        "            +            ",
        "                         ",
    ]
    assert drawn.nearest(5, 4) == "1011" and drawn.mark == (12, 5)
    assert overlay_mark(draw_points({}, 9, 3), (500.0, 0.0), 9, 3).mark is None


@pytest.mark.parametrize(
    ("seen", "words"),
    [
        ((-43.0, 17.0), "image is about 40 um left of and 20 um above the mark"),
        ((1234.0, -2.0), "image is about 1.2 mm right of the mark"),
        ((3.0, -4.0), "image is on the mark"),
        (None, "image not in the field of view"),
    ],
)
def test_an_image_is_described_within_the_acuity_of_the_eye(seen: tuple[float, float] | None, words: str) -> None:
    assert describe_image(seen, acuity=10.0) == words


def test_a_parallax_is_described_by_the_higher_image() -> None:
    assert describe_parallax((0.0, 512.0)) == "left image is about 510 um higher, no x-parallax"
    assert describe_parallax((95.0, -61.0)) == "left image is about 60 um lower, x-parallax about 100 um"


def test_step_sizes_have_a_smallest_and_a_largest() -> None:
    assert (
        ControlSelection().stepping(-99).step == STEP_SIZES[0]
        and ControlSelection().stepping(99).step == STEP_SIZES[-1]
    )


def test_a_selection_makes_lines_of_the_command_language() -> None:
    selection = ControlSelection("omega", 2).stepping(-1)
    assert selection.turned(-1) == "PROJ2:OMEG:TURN -0.1"
    assert selection.moved("X", 1, 12.0) == "WHE:X 0.1"
    assert ControlSelection(free=True).moved("Y", -1, 12.0) == "DRIV:Y 11.0000"
    assert ControlSelection().valid_for(VARIANTS["A8"]).element == "kappa1"


@pytest.mark.parametrize(
    ("utf8", "no_color", "colours", "best"),
    [
        (True, False, "truecolor", DrawingMode.HALVES),
        (True, False, "256", DrawingMode.HALVES),
        (True, False, "standard", DrawingMode.SHADES),
        (True, True, "truecolor", DrawingMode.SHADES),
        (False, False, "truecolor", DrawingMode.ASCII),
    ],
)
def test_the_drawing_follows_the_terminal(utf8: bool, no_color: bool, colours: str, best: DrawingMode) -> None:
    assert best_drawing(utf8, no_color, colours) is best


def test_utf8_follows_the_locale() -> None:
    assert speaks_utf8({"LANG": "C.UTF-8"}) and speaks_utf8({})
    assert not speaks_utf8({"LC_ALL": "C", "LANG": "en_US.UTF-8"})


def test_the_sample_keymap_equals_the_default_keymap(tmp_path: Path) -> None:
    file = tmp_path / "keys.toml"
    file.write_text(sample(), encoding="utf-8")
    assert load_keymap(file) == default_keymap()
    for watching in (False, True):
        keys = [key for action in actions_for(watching) for key in action.keys]
        assert len(keys) == len(set(keys))


def test_an_action_that_a_keymap_omits_keeps_its_keys(tmp_path: Path) -> None:
    file = tmp_path / "keys.toml"
    file.write_text('[keys]\nrecord = ["space", "f5"]\n', encoding="utf-8")
    assert load_keymap(file) == {**default_keymap(), "record": ("space", "f5")}
    assert key_name("space", " ") == "space" and key_name("plus", "+") == "+"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("[keys", "expected TOML"),
        ("[key]\n", "expected one table [keys], got key"),
        ('[keys]\nfly = "f"\n', "keys.fly: expected one of x_up"),
        ("[keys]\nrecord = 3\n", "keys.record: expected a key or a list of keys, got 3"),
        ("[keys]\nrecord = []\n", "keys.record: expected a key or a list of keys, got []"),
        ('[keys]\nrecord = "enterr"\n', "keys.record: expected a key such as k, +, pageup, f5 or ctrl+k, got 'enterr'"),
        ('[keys]\nrecord = "k"\n', "expected every key once, got 'k' for both kappa and record"),
    ],
)
def test_a_bad_keymap_is_reported_in_one_sentence(content: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "keys.toml"
    file.write_text(content, encoding="utf-8")
    with pytest.raises(A7SimError) as mistake:
        load_keymap(file)
    assert words in str(mistake.value) and str(mistake.value).startswith(str(file))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--keymap", "{folder}/none.toml"], "expected a readable file"),
        (["nowhere"], "nowhere"),
        ([], "expected a terminal, got"),
        (["--drawing", "halves", "--theme", "dark"], "expected a terminal, got"),
        (["--connect", "tcp://127.0.0.1:1"], "expected an instrument to answer there"),
        (["--connect", "tcp://127.0.0.1:1", "--seed", "7"], "expected no --seed beside it"),
    ],
)
def test_a_console_that_cannot_start_is_one_sentence_and_exit_code_2(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    monkeypatch.setattr(sys, "argv", ["a7sim", "console", *(each.format(folder=tmp_path) for each in arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    message = capsys.readouterr().err
    assert ended.value.code == 2 and words in message and message.count("\n") == 1


def test_a_keymap_is_written_only_to_a_new_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "deep" / "keys.toml"
    monkeypatch.setattr(sys, "argv", ["a7sim", "console", "--write-keymap", "--keymap", str(file)])
    for code in (0, 2):
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == code
    assert load_keymap(file) == default_keymap()
    assert "expected to write a new file" in capsys.readouterr().err


SLOPE = (np.add.outer(np.arange(8), np.arange(8)) * 18).astype(np.uint8)
"""Light from the top left, 0, to the bottom right, 252."""


@pytest.mark.parametrize(
    ("drawing", "golden"),
    [
        (DrawingMode.SHADES, ["   ░░▒░▒", "░░▒░▒▒▓▓", "░▒░▒▒▓▓▓", "▒▒▓▓▓▓██"]),
        (DrawingMode.ASCII, [" ..::==+", "::--=+**", "-==++**#", "++**##%%"]),
        (DrawingMode.BRAILLE, ["⠀⢄⢕⢵", "⢕⢵⢽⣽"]),
    ],
)
def test_a_slope_in_every_drawing_without_colours(drawing: DrawingMode, golden: list[str]) -> None:
    assert text(rasterize.render(drawing, SLOPE)) == golden


def test_a_slope_in_an_eyepiece_at_32_greys() -> None:
    """Grey levels of foreground and background by cell; the corners are darkened."""
    shown = rasterize.half_blocks(rasterize.apply_vignette(SLOPE))
    cells = [[(run.ink, run.paper) for run in row for _ in run.text] for row in shown]
    assert cells == [
        [(0, 1), (1, 3), (3, 6), (5, 8), (7, 10), (9, 12), (10, 13), (8, 13)],
        [(3, 5), (6, 8), (8, 11), (11, 13), (13, 15), (15, 17), (17, 19), (17, 19)],
        [(7, 9), (10, 12), (13, 15), (15, 17), (17, 20), (20, 22), (21, 23), (21, 22)],
        [(10, 8), (13, 13), (17, 17), (19, 19), (21, 21), (23, 22), (23, 21), (21, 17)],
    ]
