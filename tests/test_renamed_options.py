"""Old names of options and commands are accepted for one release, warn and are not shown (issue 19)."""

import json
from pathlib import Path

import click
import pytest
from click.shell_completion import BashComplete

from a7sim.cli import cli
from a7sim.cli.renamed import command_with_renamed_options

OPTIONS = [
    ("console", "--go-on", "--resume", ["akwanga"], ("resume", True)),
    ("console", "--anew", "--new", ["akwanga"], ("resume", False)),
    ("train start", "--anew", "--new", ["4"], ("new", True)),
    ("train report", "--to", "--format", ["json"], ("file_format", "json")),
    ("serve", "--listen-anyway", "--allow-remote", ["akwanga"], ("allow_remote", True)),
    ("export", "--way", "--method", ["A8", "runs", "--to", "cards"], ("method", "A8")),
    ("reduce strip", "--against", "--reference", ["known.csv", "cards.crd"], ("reference", "known.csv")),
    (
        "reduce absolute",
        "--against",
        "--reference",
        ["known.csv", "m.csv", "--ground", "g.csv"],
        ("reference", "known.csv"),
    ),
    (
        "reduce block",
        "--against",
        "--reference",
        ["known.csv", "m.csv", "--ground", "g.csv"],
        ("reference", "known.csv"),
    ),
]
COMMANDS = [("verify", "grade"), ("check", "check-exercise")]


def command_named(name):
    command = cli
    for word in name.split():
        command = command.get_command(click.Context(command), word)
    return command


def warning(old, new):
    return f"a7sim: {old} is now called {new}; the old name will be removed in the next release\n"


@pytest.mark.parametrize(("name", "old", "new", "others", "expected"), OPTIONS)
def test_an_old_option_sets_the_same_parameter_and_warns(capsys, name, old, new, others, expected):
    context = command_named(name).make_context(name, [old, *others])
    parameter, value = expected
    assert str(context.params[parameter]) == str(value)
    assert capsys.readouterr() == ("", warning(old, new))
    assert command_named(name).make_context(name, [new, *others]).params == context.params
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(("name", "old", "new"), [each[:3] for each in OPTIONS])
def test_help_lists_only_the_new_option(typed, name, old, new):
    code, out, err = typed(*name.split(), "--help")
    assert (code, err) == (0, "")
    assert new in out and old not in out.replace(new, "")


def test_an_old_option_takes_a_value_after_an_equals_sign(capsys):
    context = command_named("export").make_context("export", ["runs", "--to=cards", "--way=A8"])
    assert context.params["method"] == "A8"
    assert capsys.readouterr().err == warning("--way", "--method")


def test_an_argument_after_two_hyphens_is_not_an_option(capsys):
    command = command_with_renamed_options({"--old": "--new"})("print", params=[click.Argument(["words"], nargs=-1)])
    assert command.make_context("print", ["--", "--old"]).params == {"words": ("--old",)}
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("old", "new"), COMMANDS)
def test_an_old_command_runs_the_new_one_and_warns(typed, old, new):
    code, out, err = typed("train", old, "--nonsense")
    assert (code, out) == (2, "")
    assert err.startswith(warning(f"train {old}", f"train {new}") + f"a7sim: train {new}: expected an option")
    assert typed("train", old, "--help")[1] == typed("train", new, "--help")[1]


@pytest.mark.parametrize("old", [old for old, _ in COMMANDS])
def test_help_and_completion_list_only_the_new_command(typed, capsys, old):
    listed = typed("train", "--help")[1].partition("Commands:\n")[2]
    assert old not in [line.split()[0] for line in listed.splitlines()]
    completer = BashComplete(cli, {}, "a7sim", "_A7SIM_COMPLETE")
    assert old not in [each.value for each in completer.get_completions(["train"], "")]
    assert "--json" in [each.value for each in completer.get_completions(["train", old], "--")]
    assert capsys.readouterr().err == ""


def test_a_document_keeps_the_command_of_the_first_release(typed, tmp_path, monkeypatch):
    monkeypatch.setenv("A7SIM_HOME", str(tmp_path))
    script = Path(__file__).parents[1] / "exercises" / "01-counters" / "reference.a7s"
    typed("train", "start", 1, "--seed", 1, "--script", script)
    _, out, err = typed("train", "grade", "--json")
    assert (json.loads(out)["command"], err) == ("train verify", "")
    assert typed("train", "verify", "--json") == (0, out, warning("train verify", "train grade"))
