"""Unusable files: every command prints one sentence with the place and ends with exit code 2."""

import subprocess
import sys

import numpy as np
import pytest

from a7sim import cli

GROUND = "point,X,Y,Z,role\n1,0,0,0,control\n2,900,0,5,control\n3,0,900,1,control\n4,900,900,2,check\n"
CAMERA = """c = 152.0
fiducials = [
  { name = "1", x = -106.0, y = -106.0 }, { name = "2", x = 106.0, y = 106.0 },
  { name = "3", x = -106.0, y = 106.0 }, { name = "4", x = 106.0, y = -106.0 },
]
"""

COMMANDS = {
    "interior": (["--camera", "camera.toml"], "photo,point,x,y", ["7", "1", "-106.1", "-106"]),
    "relative": (["--c", "152"], "point,xl,yl,xr,yr", ["1", "1", "2", "-90", "3"]),
    "centres": ([], "point,X1,Y1,X2,Y2", ["1", "4900", "4900", "4910", "4920"]),
    "centres levels": (["--method", "levels"], "point,level,X,Y", ["1", "4900", "4990", "4980"]),
    "centres grid": (["--method", "grid", "--c", "152"], "point,x,y,X,Y,Z", ["1", "0", "80", "300", "200", "40"]),
    "centres a8": (["--method", "a8"], "model,base,column,height", ["1", "180", "420", "15"]),
    "similarity": ([], "point,x,y,z,X,Y,Z", ["1", "0", "1", "2", "3", "4", "5"]),
    "connect": ([], "model,point,X,Y,Z", ["1", "5", "0", "1", "2"]),
    "strip": (["--c", "152", "--ground", "ground.csv"], "model,point,xl,yl,xr,yr", ["1", "5", "1", "2", "-90", "3"]),
    "strip models": (["--ground", "ground.csv"], "model,point,X,Y,Z", ["1", "5", "0", "1", "2"]),
    "absolute": (["--ground", "ground.csv"], "point,X,Y,Z", ["5", "0", "1", "2"]),
    "block": (["--ground", "ground.csv"], "model,point,X,Y,Z", ["1", "5", "0", "1", "2"]),
}


def missing_column(header, row):
    return "\n".join([",".join(header[:-1]), ",".join(row[:-1])]), ["line 1", header[-1]]


def letters(header, row):
    return "\n".join([",".join(header), ",".join([*row[:-1], "1l.5"])]), ["line 2", f"column {header[-1]}", "'1l.5'"]


def decimal_comma(header, row):
    return "\n".join([",".join(header), ",".join([*row[:-1], "1,5"])]), ["line 2", "columns"]


def not_finite(header, row):
    return "\n".join([",".join(header), ",".join([*row[:-1], "nan"])]), ["line 2", f"column {header[-1]}"]


def beyond_measure(header, row):
    return "\n".join([",".join(header), ",".join([*row[:-1], "1e300"])]), ["line 2", f"column {header[-1]}"]


def twice(header, row):
    return "\n".join([",".join(header), ",".join(row), "# the same again", ",".join(row)]), ["line 4"]


def without_name(header, row):
    return "\n".join([",".join(header), ",".join(["", *row[1:]])]), ["line 2", f"column {header[0]}"]


def header_twice(header, row):
    return "\n".join([",".join([*header, header[0]]), ",".join([*row, row[0]])]), ["line 1", header[0]]


def line_break_in_a_name(header, row):
    return ",".join(header) + '\n"a\nb",' + ",".join(row[1:]), ["line 3", f"column {header[0]}"]


def long_name(header, row):
    return "\n".join([",".join(header), ",".join(["9" * 5000, *row[1:]])]), ["line 2", f"column {header[0]}"]


def line_break_in_the_header(header, row):
    return "\n".join(['"a\nb",' + ",".join(header[1:]), ",".join(row)]), ["expected the columns"]


def empty(header, row):
    return "", ["empty file"]


def comments_only(header, row):
    return "# nothing\n\n", ["nothing but comments"]


def header_only(header, row):
    return ",".join(header), ["rows under the header"]


def too_few(header, row):
    return "\n".join([",".join(header), ",".join(row)]), []


def binary(header, row):
    return np.random.default_rng(0).bytes(3000), ["line", "column"]


def control_byte(header, row):
    return ",".join(header) + "\n" + ",".join(row[:-1]) + ",\x00\n", ["line 2", "column"]


def open_quote(header, row):
    return ",".join(header) + '\n"' + ",".join(row), ["line 2"]


def toml_of_columns(header, row):
    return "[[rows]]\n" + "".join(f"{name} = 1\n" for name in header[:-1]), ["expected the columns", header[-1]]


def toml_with_letters(header, row):
    return "[[rows]]\n" + "".join(f'{name} = "x"\n' for name in header), ["row 1", "expected"]


def toml_broken(header, row):
    return "[[rows]\nx = 1\n", ["line 1", "column"]


FAULTS = [
    missing_column, letters, decimal_comma, not_finite, beyond_measure, twice, without_name, header_twice, empty,
    comments_only, line_break_in_a_name, long_name, line_break_in_the_header, header_only, too_few, binary,
    control_byte, open_quote, toml_of_columns, toml_with_letters, toml_broken,
]  # fmt: skip


@pytest.fixture
def run_reduce(tmp_path, monkeypatch, capsys):
    """Run a command in a folder with good ground and camera files; return the exit code and the message."""
    (tmp_path / "ground.csv").write_text(GROUND, encoding="utf-8")
    (tmp_path / "camera.toml").write_text(CAMERA, encoding="utf-8")
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["a7sim", "reduce", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        captured = capsys.readouterr()
        assert captured.out == ""
        return ended.value.code, captured.err

    return run


def one_sentence(answer, *words):
    code, text = answer
    assert code == 2
    assert text.count("\n") == 1, text
    assert text.startswith("a7sim: "), text
    assert text.isprintable() or text[:-1].isprintable(), text
    for word in words:
        assert word in text


ENOUGH_FOR_AN_A8 = (too_few,)


@pytest.mark.parametrize(
    ("command", "fault"),
    [
        pytest.param(command, fault, id=f"{command}, {fault.__name__}")
        for command in COMMANDS
        for fault in FAULTS
        if command != "centres a8" or fault not in ENOUGH_FOR_AN_A8
    ],
)
def test_the_error_message_of_a_bad_file_is_one_sentence_with_its_place(run_reduce, tmp_path, command, fault):
    options, header, row = COMMANDS[command]
    content, words = fault(header.split(","), row)
    path = tmp_path / ("bad.toml" if fault.__name__.startswith("toml") else "bad.csv")
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    one_sentence(run_reduce(command.split()[0], path.name, *options), path.name, *words)


@pytest.mark.parametrize("command", COMMANDS)
def test_folders_long_files_and_missing_files_are_refused(run_reduce, tmp_path, command):
    options, _, _ = COMMANDS[command]
    command = command.split()[0]
    (tmp_path / "folder").mkdir()
    one_sentence(run_reduce(command, "folder", *options), "expected a file, got the folder 'folder'")
    one_sentence(run_reduce(command, "none.csv", *options), "none.csv", "No such file")
    with (tmp_path / "noise.csv").open("wb") as file:
        file.truncate(100_000_000)
    one_sentence(run_reduce(command, "noise.csv", *options), "noise.csv", "at most")
    one_sentence(run_reduce(command, "/dev/zero", *options), "at most")


@pytest.mark.parametrize("command", [name for name, (options, _, _) in COMMANDS.items() if "--ground" in options])
@pytest.mark.parametrize(
    ("content", "words"),
    [
        (GROUND.replace("check", "chek"), ["line 5", "column role", "'chek'"]),
        (GROUND.replace("900,0,5", "900,,5"), ["line 3", "column Y", "control"]),
        (GROUND.replace("900,900,2", ",,"), ["line 5", "column X", "check"]),
        (GROUND.replace("4,900", "3,900"), ["line 5", "line 4"]),
        ("point,X,Y,Z\n1,0,0,0\n", ["line 1", "role"]),
        ("", ["empty file"]),
    ],
)
def test_the_error_message_names_line_and_column_of_bad_ground(run_reduce, tmp_path, command, content, words):
    options, header, row = COMMANDS[command]
    (tmp_path / "good.csv").write_text(f"{header}\n{','.join(row)}\n", encoding="utf-8")
    (tmp_path / "ground.csv").write_text(content, encoding="utf-8")
    one_sentence(run_reduce(command.split()[0], "good.csv", *options), "ground.csv", *words)


DECK = """\
      101 1000.000 2000.000  100.000
      102 1500.000 2000.000  110.000
  -1
   1  101   10.000   20.000    1.000
   2  103   40.000  -20.000   -1.000
"""


@pytest.mark.parametrize("command", ["strip", "connect"])
def test_the_error_message_names_the_columns_of_a_shifted_card(run_reduce, tmp_path, command):
    (tmp_path / "deck").write_text(DECK.replace("   1  101", "  1  101"), encoding="utf-8")
    one_sentence(run_reduce(command, "deck"), "deck, line 4, columns 1-4")
    (tmp_path / "deck.crd").write_text("model,point\n", encoding="utf-8")
    one_sentence(run_reduce(command, "deck.crd"), "deck.crd, line 1, column")


@pytest.mark.parametrize(
    "points",
    [
        [(x, 0.3 * x) for x in range(0, 90, 10)],
        [(10.0, 20.0)] * 8,
    ],
    ids=["on a line", "in one place"],
)
@pytest.mark.parametrize("method", ["coplanarity", "parallax", "schut", "robust", "all"])
def test_a_degenerate_pair_is_refused_with_the_condition_number(run_reduce, tmp_path, points, method):
    rows = [f"{i},{x},{y},{x - 90},{y}" for i, (x, y) in enumerate(points)]
    (tmp_path / "pair.csv").write_text("point,xl,yl,xr,yr\n" + "\n".join(rows) + "\n", encoding="utf-8")
    answer = run_reduce("relative", "pair.csv", "--c", 152, "--method", method)
    one_sentence(answer, "pair.csv", "condition number")


def test_an_out_folder_that_is_a_file_is_refused_and_nothing_is_left_behind(run_reduce, tmp_path):
    (tmp_path / "a8.csv").write_text("model,base,column,height\n1,180,420,15\n", encoding="utf-8")
    one_sentence(run_reduce("centres", "a8.csv", "--method", "a8", "--out", "camera.toml"), "camera.toml", "folder")
    (tmp_path / "o" / "results.json").mkdir(parents=True)
    one_sentence(run_reduce("centres", "a8.csv", "--method", "a8", "--out", "o"), "o: expected a folder")
    assert sorted(each.name for each in (tmp_path / "o").iterdir()) == ["points.csv", "results.json"]


def test_help_loads_no_scipy_and_names_every_command():
    for arguments in (["--help"], ["reduce", "--help"], ["reduce", "strip", "--help"], ["reduce", "block", "--help"]):
        code = (
            "import sys; sys.argv[1:] = " + repr(arguments) + "\n"
            "from a7sim.cli import main\n"
            "try:\n    main()\nexcept SystemExit: pass\n"
            "print(sorted(set(sys.modules) & {'scipy', 'textual', 'matplotlib', 'hypothesis'}))"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout.splitlines()[-1] == "[]"
        if arguments == ["reduce", "--help"]:
            for command in ("interior", "relative", "centres", "similarity", "connect", "strip", "absolute", "block"):
                assert f"\n  {command} " in done.stdout


PAIRS = "model,point,xl,yl,xr,yr\n" + "".join(
    f"1,{name},{x},{y},{x - 90.0},{y}\n"
    for name, x, y in ((1, 0, 0), (2, 90, 0), (3, 0, 80), (4, 90, 80), (5, 0, -80), (6, 90, -80))
)
MODELS = "model,point,X,Y,Z\n1,5,0,1,2\n2,5,0,1,2\n"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ("absolute", "models.csv", "--ground", "ground.csv"),
            "column model: expected one model, got 2; `reduce strip`",
        ),
        (("strip", "models.csv"), "expected ground points (--ground), which only cards bring with them, got none"),
        (
            ("strip", "pairs.csv", "--ground", "ground.csv"),
            "expected the principal distance (--c) of the pairs, got none",
        ),
        (
            ("strip", "turned.csv", "--ground", "ground.csv", "--c", "152"),
            "got a mean x-parallax of -90.000 mm (is the pair given right to left?)",
        ),
    ],
)
def test_the_error_message_names_the_file_and_the_missing_part_of_a_strip(run_reduce, tmp_path, words, sentence):
    turned = PAIRS.replace("xl,yl,xr,yr", "xr,yr,xl,yl")
    for name, text in (("models.csv", MODELS), ("pairs.csv", PAIRS), ("turned.csv", turned)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    one_sentence(run_reduce(*words), words[1], sentence)
