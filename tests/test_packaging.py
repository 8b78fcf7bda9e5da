"""Built packages: the wheel is complete and works without the checkout, and the sdist makes the same
wheel (issue 10)."""

import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from email.parser import Parser
from importlib.util import find_spec
from pathlib import Path

import pytest

import a7sim
from a7sim.bundled import bundled_names
from a7sim.cli.doctor import NOT_FOR_USERS

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

pytestmark = pytest.mark.skipif(find_spec("hatchling") is None, reason="hatchling is not installed (extra dev)")


def built(target, source, out):
    """Return what hatchling builds of a source tree."""
    command = [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", out]
    subprocess.run(command, cwd=source, check=True, capture_output=True)
    return next(out.iterdir())


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return built("wheel", ROOT, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def sdist(tmp_path_factory):
    return built("sdist", ROOT, tmp_path_factory.mktemp("sdist"))


@pytest.fixture(scope="module")
def contents(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.fixture(scope="module")
def away(wheel, tmp_path_factory):
    """Run the wheel's a7sim with the libraries that are here, but without the checkout, in an empty folder."""
    installation = tmp_path_factory.mktemp("installed")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(installation / "site")
    (installation / "empty").mkdir()
    (installation / "without").mkdir()
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "A7SIM"))}
    program = "import sys; sys.path.insert(0, sys.argv.pop(1)); blocked = sys.argv.pop(1).split(','); \
sys.modules.update(dict.fromkeys(filter(None, blocked))); from a7sim.cli import main; main()"

    def typed(*words, without=""):
        command = [sys.executable, "-c", program, installation / "site", without, *words]
        return subprocess.run(
            command,
            cwd=installation / "empty",
            env=environment | {"A7SIM_HOME": str(installation / "home")},
            capture_output=True,
            text=True,
            check=False,
        )

    return typed


def test_the_wheel_has_all_files_of_a7sim(contents):
    in_package = {name.removeprefix("a7sim/") for name in contents if name.startswith("a7sim/")}
    for kind in ("scenarios", "exercises", "studies"):
        files = {str(path.relative_to(ROOT)) for path in (ROOT / kind).rglob("*") if path.is_file()}
        assert {name for name in files if "__pycache__" not in name} <= in_package
    sources = [path for path in (ROOT / "src" / "a7sim").rglob("*") if path.is_file() and path.suffix != ".pyc"]
    assert {str(path.relative_to(ROOT / "src" / "a7sim")) for path in sources} <= in_package
    assert {"py.typed", "__init__.pyi", "console/app.tcss", "console/page/app_index.html"} <= in_package
    assert not [name for name in contents if re.match(r"(tests|docs|benchmarks)/", name) or name.endswith(".pyc")]


def test_the_metadata_of_the_wheel_are_complete(contents):
    metadata_text = next(text.decode() for name, text in contents.items() if name.endswith("/METADATA"))
    metadata = Parser().parsestr(metadata_text)
    assert metadata["Version"] == a7sim.__version__
    assert metadata["Requires-Python"] == PROJECT["requires-python"]
    assert set(metadata.get_all("Provides-Extra")) == set(PROJECT["optional-dependencies"])
    entry = next(text.decode() for name, text in contents.items() if name.endswith("/entry_points.txt"))
    assert "a7sim = a7sim.cli:main" in entry
    assert any(name.endswith("/licenses/LICENSE") for name in contents)


def test_all_asks_for_every_extra_of_a_user():
    extras = PROJECT["optional-dependencies"]
    (everything,) = extras["all"]
    assert set(re.fullmatch(r"a7sim\[(.*)\]", everything)[1].split(",")) == set(extras) - set(NOT_FOR_USERS)


def test_the_sdist_makes_the_same_wheel(sdist, contents, tmp_path):
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path / "source", filter="data")
    (source,) = (tmp_path / "source").iterdir()
    with zipfile.ZipFile(built("wheel", source, tmp_path / "again")) as archive:
        again = {name: archive.read(name) for name in archive.namelist()}
    assert again == contents
    assert (source / "tests").is_dir()
    assert (source / "Makefile").is_file()


def test_the_wheel_works_without_the_checkout(away):
    assert away("--version").stdout == f"a7sim, version {a7sim.__version__}\n"
    run = away("run", "dewitt-pair", "--json")
    assert run.returncode == 0, run.stderr
    assert json.loads(run.stdout)["status"] == "complete"
    listed = json.loads(away("train", "list", "--json").stdout)
    assert len(listed["exercises"]) == len(bundled_names("exercises")) > 0
    unknown = away("study", "nothing")
    assert unknown.returncode == 2
    assert all(name in unknown.stderr for name in bundled_names("studies"))
    unknown = away("replay", "nothing")
    assert "clearing" in unknown.stderr


@pytest.mark.parametrize(
    ("words", "without", "extra"),
    [
        (["console", "akwanga"], "textual", "console"),
        (["console", "akwanga", "--browser"], "textual_serve,textual_serve.server", "browser"),
        (["report", "session"], "matplotlib", "report"),
    ],
)
def test_a_command_that_needs_an_extra_reports_it_in_one_sentence(away, gave_up_folder, words, without, extra):
    given = [str(gave_up_folder) if word == "session" else word for word in words]
    done = away(*given, without=without)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1), done.stderr
    assert done.stderr.startswith("a7sim: ")
    assert f"pip install 'a7sim[{extra}]'" in done.stderr


@pytest.mark.skipif(shutil.which("git") is None or not (ROOT / ".git").exists(), reason="no checkout")
def test_the_sdist_has_nothing_that_git_ignores(sdist):
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    known = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    with tarfile.open(sdist) as archive:
        within = {member.name.partition("/")[2] for member in archive.getmembers() if member.isfile()}
    assert within - set(known) == {"PKG-INFO"}
