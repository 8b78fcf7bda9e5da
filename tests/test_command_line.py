"""All commands: one grammar, quick start, completion in shells; doctor (issue 10)."""

import json
import os
import re
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import click
import pytest
from click.shell_completion import BashComplete

from a7sim.bundled import bundled_names
from a7sim.cli import cli, doctor, main
from a7sim.cli.lazy_group import LazyGroup
from a7sim.cli.options import PLOTTERS
from a7sim.cli.prompt import data_folder
from a7sim.plotters import VARIANTS
from tests.support.processes import a7sim_in_process

ROOT = Path(__file__).parents[1]
BIN = Path(sys.executable).parent

NO_DOCUMENT = {
    "console": "a screen",
    "report": "writes a page",
    "export": "writes what --to says",
    "completion": "a script for a shell",
    "train start": "a checklist, and the instrument",
    "train watch": "a screen",
    "train report": "--format json",
    "train reset": "does what it says",
    "train new": "writes a folder",
}
"""Commands that print no document, with the reason."""

LIGHT = ("run", "operate", "compile", "calibrate", "bridge", "report", "compare", "train", "doctor", "completion")
"""Commands whose --help imports neither numpy nor rich."""


def all_commands():
    def below(command, words):
        if isinstance(command, click.Group):
            context = click.Context(command)
            for name in command.list_commands(context):
                yield from below(command.get_command(context, name), (*words, name))
        yield words, command

    return {" ".join(words): command for words, command in below(cli, ())}


COMMANDS = all_commands()
VERBS = {name: command for name, command in COMMANDS.items() if not isinstance(command, click.Group)}


def options_of(command):
    return {name: option for option in command.params if isinstance(option, click.Option) for name in option.opts}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_a_description_and_an_example(name):
    first, *_ = COMMANDS[name].help.split("\n\n")
    assert " ".join(first.split()).endswith(".")
    example = re.search(r"Example: (a7sim .*)", COMMANDS[name].help)
    assert example, f"{name} has no example"
    assert example[1].startswith(f"a7sim {name}".strip())


@pytest.mark.parametrize("name", [*VERBS])
def test_every_example_is_accepted_by_its_command(name):
    words = re.search(r"Example: a7sim (.*)", COMMANDS[name].help)[1].partition(" > ")[0]
    given = [word.strip("'") for word in re.findall(r"'[^']*'|\S+", words)][len(name.split()) :]
    assert VERBS[name].make_context(name, list(given)).params


@pytest.mark.parametrize("name", VERBS)
def test_options_have_help_and_equal_options_have_equal_placeholders(name):
    options = options_of(VERBS[name])
    for option, parameter in options.items():
        assert parameter.help, f"{name} {option} has no help"
        assert "  " not in parameter.help.replace("  [default", "")
    context = click.Context(VERBS[name])
    metavars = {option: parameter.make_metavar(context) for option, parameter in options.items()}
    assert metavars.get("--seed", "N") == "N"
    assert metavars.get("--out", "DIR") in ("DIR", "FILE")
    assert metavars.get("--token-file", "FILE") == "FILE"
    for document in ("--json", "--quiet", "--force"):
        assert document not in options or options[document].is_flag


OPTIONS_WITH_SEVERAL_MEANINGS = {
    "--method": "a procedure, or a way to compute",
    "--flying-height": "above the ground for prepare, above the sea for refraction",
    "--link": "where one is served, or where to serve",
    "--out": "what is left there",
    "--quiet": "replay says how --verify ended",
    "--resume": "the last session of a console, or the folder of a session",
    "--speed": "a pace, or any number",
}
"""Options with different meanings in different commands, with the reason."""


def test_an_option_has_the_same_help_in_every_command():
    meanings = {}
    for command in VERBS.values():
        for name, option in options_of(command).items():
            meaning = (option.help.partition("  [")[0].rstrip("."), option.make_metavar(click.Context(command)))
            meanings.setdefault(name, set()).add(meaning)
    assert {name for name, found in meanings.items() if len(found) > 1} == set(OPTIONS_WITH_SEVERAL_MEANINGS)
    assert all(re.match("(Folder|File) for ", about) for about, _ in meanings["--out"])


def test_the_choices_of_plotter_are_the_variants():
    assert tuple(VARIANTS) == PLOTTERS


def test_every_command_that_has_a_document_prints_it_as_json():
    assert {name for name in VERBS if "--json" not in options_of(VERBS[name])} == set(NO_DOCUMENT)


FLOWN = ("--c", "152.676", "--photo-scale", "8000", "--photo-base", "91")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["stereo"], "expected a command, got 'stereo'"),
        (["reduce", "strap"], "reduce: expected a command, got 'strap'; did you mean strip?"),
        (["run", "akwanga", "--sed", "1"], "run: expected an option of this command, got --sed; did you mean"),
        (["run", "akwanga", "--case", "F"], "--case: expected one of A, B, C, D, E, got 'F'"),
        (["run", "akwanga", "--seed", "-1"], "--seed: expected 0 or more, got -1"),
        (["run", "akwanga", "--seed", "x"], "--seed: expected a whole number, got 'x'"),
        (["calibrate", "grid-test", "--levels", "9"], "--levels: expected 1 to 5, got 9"),
        (["console", "--acuity", "0"], "--acuity: expected more than 0, 10000 at the most, got 0.0"),
        (["operate"], "operate: expected SCENARIO, got none"),
        (["operate", "akwanga"], "operate: expected --link, got none"),
        (["run", "a", "b"], "run: expected nothing more, got b"),
        (["run", "--out"], "expected a value after '--out', got none"),
        (["prepare", "--heights", "1"], "expected 2 values after '--heights', got fewer"),
        (["train", "start", "1", "--script", "."], "--script: expected a file, got the folder '.'"),
        (["train", "grade", "--journal", __file__], "--journal: expected a folder, got the file"),
        (["train", "grade", "--journal", "nowhere"], "--journal: expected one that exists, got 'nowhere'"),
        (["train", "start", "1", "--link", "localhost"], "--link: expected tcp://HOST:PORT, got 'localhost'"),
        (["run", "/"], "/: expected a scenario file or one of a8-strip, "),
        (["study", "/"], "/: expected the file of a study or one of a7-a8-comparator, "),
        (
            ["prepare", *FLOWN, "--heights", "2", "1"],
            "--heights: expected the lowest ground before the highest, got 2 a",
        ),
        (
            ["prepare", *FLOWN, "--flying-height", "900", "--heights", "1", "2"],
            "prepare: expected --photo-scale or --fl",
        ),
        (["prepare", *FLOWN, "--heights", "1", "9000"], "--heights: expected ground below the flight, got 9000 m, 32"),
        (["run"], "run: expected SCENARIO or --resume DIR, got none"),
        (["run", "akwanga", "--resume", "x"], "--resume: expected no SCENARIO with it"),
        (["serve"], "serve: expected SCENARIO or --resume DIR, got none"),
        (["serve", "akwanga", "--rfc2217", "8.8.8.8:1"], "--rfc2217 8.8.8.8:1: expected an address of this machine al"),
        (["train", "start"], "train start: expected EXERCISE, such as 4 (a7sim train list), or --exam"),
        (["compile", "akwanga", "--model", "9"], "--model: expected one of 1, 2, got 9"),
        (["compile", "akwanga", "--line", "nope"], "--line: expected one of road1, track1, got nope"),
        (["compile", "akwanga"], "compile: expected a --contour, an --interval or a --line to be drawn, got none"),
        (["send", "tcp://127.0.0.1:1", "--timeout", "nan"], "--timeout: expected a finite number, got nan"),
        (
            ["record", "a7sim://akwanga", "--seed", "1", "--out", "x"],
            "--seed: expected a --scenario beside it, got none",
        ),
        (
            ["record", "a7sim://akwanga", "--tcp", "8.8.8.8:1", "--out", "x"],
            "--tcp 8.8.8.8:1: expected an address of this machine alone",
        ),
        (
            ["record", "a7sim://akwanga", "--scenario", "akwanga", "--tcp", "8.8.8.8:1", "--out", "x"],
            "--tcp 8.8.8.8:1: expected an address of this machine alone",
        ),
        (
            ["train", "start", "1", "--serve", "--link", "tcp://127.0.0.1:1"],
            "train start: expected one of --script, --link and --serve, got several",
        ),
        (["train", "start", "1", "--student", " "], "--student: expected a name of 1 to"),
        (["train", "start", "99"], "99: expected the number of an exercise, its folder, or one of 01-counters, "),
        (
            ["reduce", "interior", "x.csv", "--camera", "x.toml", "--flying-height", "300", "--ground-height", "300"],
            "--flying-height: expected more than the ground height of 300 m, got 300",
        ),
        (["completion", "tcsh"], "SHELL: expected one of bash, zsh, fish, got 'tcsh'"),
    ],
)
def test_a_wrong_command_line_is_reported_in_one_sentence(typed, words, sentence):
    code, out, err = typed(*words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"a7sim: {sentence}")


def test_without_textual_the_error_message_names_its_installation(typed, monkeypatch):
    monkeypatch.setitem(sys.modules, "textual", None)
    message = "a7sim: console: expected textual to be installed: pip install 'a7sim[console]'\n"
    assert typed("console", "akwanga") == (2, "", message)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"a = " + b"[" * 5000 + b"]" * 5000, "expected TOML, got a file that breaks its rules: tables within tables"),
        (b"title = 'Z\xfcrich'", "line 1, column 11: expected UTF-8 text, got bytes that are none"),
    ],
    ids=["too deep", "not UTF-8"],
)
@pytest.mark.parametrize("words", [["run"], ["study"], ["train", "check-exercise"], ["console", "akwanga", "--keymap"]])
def test_every_reader_of_toml_reports_a_bad_file_in_the_same_words(typed, tmp_path, words, content, sentence):
    folder = tmp_path / "20-clouds"
    folder.mkdir()
    path = folder / "exercise.toml"
    path.write_bytes(content)
    code, _, err = typed(*words, folder if words[0] == "train" else path)
    assert (code, err.count("\n")) == (2, 1)
    assert str(path) in err and sentence in err


@pytest.mark.parametrize("name", VERBS)
def test_every_command_refuses_an_unknown_option(typed, name):
    code, out, err = typed(*name.split(), "--nonsense")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("a7sim: ")


@pytest.mark.parametrize("group", [name for name, each in COMMANDS.items() if isinstance(each, LazyGroup)])
def test_the_summary_of_a_command_in_a_list_fits_one_line(typed, group):
    _, listed, _ = typed(*group.split(), "--help")
    lines = listed.partition("Commands:\n")[2].splitlines()
    assert len(lines) == len(COMMANDS[group].list_commands(click.Context(COMMANDS[group])))
    assert all(line.endswith(".") and len(line) <= 80 for line in lines)


def modules_of(*words):
    """Return the modules that a command has imported when it ends."""
    program = f"import atexit, sys; atexit.register(lambda: print(*sorted(sys.modules), file=sys.stderr)); \
sys.argv = {['a7sim', *words]!r}; from a7sim.cli import main; main()"
    return set(
        subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stderr.split()
    )


def test_listing_the_commands_imports_none_of_them():
    imported = {name for name in modules_of("--help") if name.startswith("a7sim")}
    assert imported == {
        "a7sim",
        "a7sim.cli",
        "a7sim.cli.lazy_group",
        "a7sim.cli.renamed",
        "a7sim.cli.usage_errors",
        "a7sim.errors",
    }


@pytest.mark.parametrize("verb", LIGHT)
def test_a_light_command_prints_its_help_without_heavy_imports(verb):
    assert not {"numpy", "scipy", "rich", "textual", "matplotlib"} & modules_of(verb, "--help")


HEAVY_HELP = """
import sys
from a7sim.cli import cli
from tests.test_command_line import all_commands
print(sorted(set(sys.modules) & {"scipy", "textual", "matplotlib"}))
"""


def test_no_command_imports_scipy_textual_or_matplotlib_for_its_help():
    done = subprocess.run([sys.executable, "-c", HEAVY_HELP], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# --- completion ---------------------------------------------------------------------------------------------

IN_A_SHELL = ("a7sim ser", "a7sim run akwanga-", "a7sim train ve")
COMPLETED = [
    ("a7sim ser", {"serve"}),
    ("a7sim train gr", {"grade"}),
    ("a7sim run --ca", {"--case"}),
    ("a7sim run --case ", {"A", "B", "C", "D", "E"}),
    ("a7sim run akwanga-", {"akwanga-a8", "akwanga-lake"}),
    ("a7sim train start 04", {"04-parallax"}),
    ("a7sim study lev", {"levels"}),
    ("a7sim replay cle", {"clearing"}),
    ("a7sim reduce str", {"strip"}),
]
IN_FISH = """
a7sim completion fish | source
for line in $argv
    echo (complete -C $line | cut -f1)
end
"""

IN_ZSH = """
autoload -Uz compinit
compinit -D
eval "$(a7sim completion zsh)"
[[ $_comps[a7sim] == _a7sim_completion ]] || echo no completion
compadd() { shift; print -r -- $completions }
_describe() { print -r -- ${${(P)3}%%:*} }
for line in "$@"; do
    words=(${=line}) CURRENT=$#words
    _a7sim_completion
done
"""

ENVIRONMENT = os.environ | {"PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}"}

IN_BASH = """
eval "$(a7sim completion bash)"
for line in "$@"; do
    COMP_LINE=$line COMP_POINT=${#line}
    read -ra COMP_WORDS <<< "$line"
    [[ $line == *" " ]] && COMP_WORDS+=("")
    COMP_CWORD=$((${#COMP_WORDS[@]} - 1)) COMPREPLY=()
    compopt() { :; }
    _a7sim_completion a7sim
    echo "${COMPREPLY[*]}"
done
"""


def asked(shell, script):
    """Return the completions of a shell, one set for each line of `IN_A_SHELL`."""
    lines = [line for line, _ in COMPLETED if line in IN_A_SHELL]
    done = subprocess.run(
        [shell, "-c", script, *([shell] if shell != "fish" else []), *lines],
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == ""
    return [set(reply.split()) for reply in done.stdout.splitlines()]


WANTED = [wanted for line, wanted in COMPLETED if line in IN_A_SHELL]


@pytest.mark.parametrize(("line", "wanted"), COMPLETED)
def test_verbs_options_choices_and_names_are_completed(line, wanted):
    words = line.split()[1:]
    incomplete = "" if line.endswith(" ") else words.pop()
    found = BashComplete(cli, {}, "a7sim", "_A7SIM_COMPLETE").get_completions(words, incomplete)
    assert {each.value for each in found} == wanted


def test_a_path_is_completed_as_a_file():
    found = BashComplete(cli, {}, "a7sim", "_A7SIM_COMPLETE").get_completions(["run"], "./mine")
    assert [(each.type, each.value) for each in found] == [("file", "./mine")]


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not here")
def test_bash_completes():
    assert asked("bash", IN_BASH) == WANTED


@pytest.mark.skipif(shutil.which("fish") is None, reason="fish is not here")
def test_fish_completes():
    assert asked("fish", IN_FISH) == WANTED


@pytest.mark.skipif(shutil.which("zsh") is None, reason="zsh is not here")
def test_zsh_completes():
    assert asked("zsh", IN_ZSH) == WANTED


@pytest.mark.parametrize("name", ["bash", "zsh", "fish"])
def test_each_completion_script_names_a7sim(typed, name):
    code, script, _ = typed("completion", name)
    assert code == 0
    assert f"_A7SIM_COMPLETE={name}_complete" in script


def test_the_default_shell_is_the_shell_of_the_user(typed, monkeypatch):
    monkeypatch.setenv("SHELL", "/usr/bin/fish")
    assert "fish_complete" in typed("completion")[1]
    monkeypatch.setenv("SHELL", "/bin/tcsh")
    assert typed("completion")[0] == 2


# --- doctor -------------------------------------------------------------------------------------------------


def test_doctor_lists_libraries_extras_and_bundled_files(typed):
    code, out, err = typed("doctor", "--json")
    found = json.loads(out)
    assert (code, err, found["healthy"]) == (0, "", True)
    installed = {each["name"]: each["installed"] for each in found["libraries"]}
    assert installed["click"] == metadata.version("click")
    assert {"console", "browser", "report"} <= set(found["extras"])
    assert found["comes_with"] == {kind: bundled_names(kind) for kind in ("scenarios", "exercises", "studies")}
    assert all(found["comes_with"].values())
    assert "Extra console: ready" in typed("doctor")[1]


REQUIRED = [
    "click>=8.1",
    "uvloop>=0.21; sys_platform != 'nowhere'",
    "winonly>=1; sys_platform == 'nowhere'",
    "textual<9,>=8.2; extra == 'console'",
    "a7sim[console]; extra == 'browser'",
    "no-such-library; extra == 'browser'",
    "a7sim[browser,console]; extra == 'all'",
]


@pytest.fixture
def with_versions(monkeypatch):
    versions = {"click": "8.5.1", "uvloop": "0.21.0", "textual": "8.2.8"}

    def version(name):
        if name not in versions:
            raise metadata.PackageNotFoundError(name)
        return versions[name]

    monkeypatch.setattr(doctor.metadata, "requires", lambda _: REQUIRED)
    monkeypatch.setattr(doctor.metadata, "version", version)
    return versions


def test_doctor_names_a_missing_extra_and_its_installation(typed, with_versions):
    code, out, _ = typed("doctor")
    assert code == 0
    assert "Extra console: ready" in out
    assert "Extra browser: missing, pip install 'a7sim[browser]'" in out
    assert "winonly" not in out
    assert "Extra all" not in out


def test_doctor_ends_with_exit_code_1_if_a_required_library_does_not_fit(typed, with_versions):
    with_versions["click"] = "8.0.4"
    code, out, _ = typed("doctor")
    assert code == 1
    assert re.search(r"click +8\.0\.4 +>=8\.1 +does not fit", out)


@pytest.mark.parametrize(
    ("version", "asked_for", "fits"),
    [
        ("8.2.8", "<9,>=8.2", True),
        ("9.0.0a1", "<9,>=8.2", False),
        ("8.1", "<9,>=8.2", False),
        ("8.10", ">=8.2", True),
        ("8.2", ">=8.2.0", True),
        ("1.1.3", "==1.1.3", True),
        ("1.1.3", "!=1.1.3", False),
        ("2.0", "", True),
    ],
)
def test_versions_are_compared_number_by_number(version, asked_for, fits):
    assert doctor.satisfies(version, asked_for) is fits


def test_doctor_imports_none_of_the_libraries_that_it_checks():
    assert not {"numpy", "scipy", "rich", "msgspec", "textual"} & modules_of("doctor")


@pytest.mark.parametrize(
    ("environment", "colours"),
    [
        ({"TERM": "xterm-256color"}, 256),
        ({"TERM": "xterm", "COLORTERM": "truecolor"}, 1 << 24),
        ({"TERM": "xterm"}, 16),
        ({"TERM": "dumb"}, 0),
        ({"TERM": "xterm-256color", "NO_COLOR": "1"}, 0),
    ],
)
def test_doctor_reports_size_and_colours_of_the_terminal(typed, monkeypatch, environment, colours):
    for name in ("TERM", "COLORTERM", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)
    for name, value in (environment | {"COLUMNS": "79", "LINES": "24"}).items():
        monkeypatch.setenv(name, value)
    terminal = json.loads(typed("doctor", "--json")[1])["terminal"]
    assert (terminal["columns"], terminal["lines"], terminal["room_for_console"]) == (79, 24, False)
    assert terminal["colours"] == colours


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (KeyboardInterrupt(), 130, "a7sim: interrupted\n"),
        (click.Abort(), 130, "a7sim: interrupted\n"),
        (click.UsageError("No such thing."), 2, "a7sim: no such thing"),
        (
            OSError(28, "No space left on device", "out.csv"),
            2,
            "a7sim: out.csv: expected to be able to write and read: No",
        ),
        (BrokenPipeError(), 1, ""),
    ],
    ids=["Ctrl-C", "a question not answered", "a wrong word", "a full disk", "a reader who went away"],
)
def test_an_error_that_ends_a_command_is_one_sentence_and_is_raised_with_debug(monkeypatch, error, code, message):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(cli, "main", fail)
    ended = a7sim_in_process("doctor")
    assert (ended.returncode, ended.stdout) == (code, "")
    assert ended.stderr.startswith(message) and ended.stderr.count("\n") == bool(message)
    monkeypatch.setattr(sys, "argv", ["a7sim", "doctor", "--debug"])
    with pytest.raises(type(error)):
        main()


def test_the_document_of_a_preparation_agrees_with_its_sheet(typed):
    asked = ["prepare", *FLOWN, "--heights", "430.24", "487.92", "--map-scale", "2500"]
    _, sheet, _ = typed(*asked)
    code, printed, err = typed(*asked, "--json")
    document = json.loads(printed)
    assert (code, err, document["command"]) == (0, "", "prepare")
    rows = [line.split()[0] for line in sheet.splitlines() if line.startswith("1:")]
    assert rows == [f"1:{each['number']:.0f}" for each in document["scales"]]
    for words in (
        f"Flown {document['flight']['flying_height']} m above",
        f"Optimum model scale 1:{document['optimum']['number']:.1f}",
        *(f"{each['bx']:.2f}" for each in document["scales"]),
    ):
        assert words in sheet


@pytest.mark.parametrize(
    ("platform", "environment", "folder"),
    [
        ("linux", {}, ".local/share/a7sim"),
        ("linux", {"XDG_DATA_HOME": "data"}, "data/a7sim"),
        ("darwin", {}, "Library/Application Support/a7sim"),
        ("win32", {}, "AppData/Local/a7sim"),
        ("win32", {"LOCALAPPDATA": "local"}, "local/a7sim"),
    ],
)
def test_the_data_folder_follows_the_platform(monkeypatch, tmp_path, platform, environment, folder):
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    for name in ("XDG_DATA_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, str(tmp_path / value))
    assert data_folder() == tmp_path / folder
