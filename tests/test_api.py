"""The Python API: ten names, quick to import, typed, with examples that run (issue 10)."""

import ast
import doctest
import importlib
import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

import a7sim
from a7sim import A7SimError, Client, InstrumentError, Operator, Scenario, Study, connect

ROOT = Path(__file__).parents[1]
MODULES_WITH_EXAMPLES = (
    "a7sim.api",
    "a7sim.link.client.client",
    "a7sim.scenario.schema",
    "a7sim.instrument.autograph",
    "a7sim.text",
)
"""Modules whose docstrings have examples."""


def imported_by(code):
    """Return the modules that a fresh interpreter has imported after `code`."""
    program = f"{code}\nimport sys; print(*sorted(sys.modules))"
    return set(
        subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
    )


def test_importing_the_package_imports_none_of_its_modules():
    own = {name for name in imported_by("import a7sim") if name.startswith("a7sim")}
    assert own == {"a7sim"}


def test_a_name_imports_its_own_module_and_no_heavy_library():
    assert not {"numpy", "click", "rich"} & imported_by("from a7sim import A7SimError")
    assert not {"scipy", "textual", "matplotlib", "click"} & imported_by("from a7sim import connect")


def test_every_public_name_exists_and_is_typed():
    stub = ast.parse((ROOT / "src" / "a7sim" / "__init__.pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    typed = {alias.name: str(node.module) for node in imports for alias in node.names}
    assert sorted(typed) == sorted(a7sim.__all__) == sorted(set(dir(a7sim)) & set(a7sim.__all__))
    assert len(a7sim.__all__) == 10
    for name, module in typed.items():
        found = importlib.import_module(f"a7sim.{name}") if module == "a7sim" else None
        assert getattr(a7sim, name) is (found or getattr(importlib.import_module(module), name))
    assert (ROOT / "src" / "a7sim" / "py.typed").exists()


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'autograph'"):
        _ = a7sim.autograph


@pytest.mark.parametrize("module", MODULES_WITH_EXAMPLES)
def test_examples_in_docstrings_run(module):
    ran = doctest.testmod(importlib.import_module(module))
    assert ran.attempted > 0
    assert ran.failed == 0


def test_every_module_with_an_example_is_tested():
    files = (ROOT / "src").rglob("*.py")
    having = [file for file in files if ">>> " in file.read_text(encoding="utf-8")]
    assert {".".join(file.relative_to(ROOT / "src").with_suffix("").parts) for file in having} == set(
        MODULES_WITH_EXAMPLES
    )


def test_the_generated_python_page_is_current():
    spec = importlib.util.spec_from_file_location("make_python", ROOT / "docs" / "make_python.py")
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    assert (ROOT / "docs" / "python.md").read_text(encoding="utf-8") == maker.page(), "run python docs/make_python.py"
    assert set(maker.ORDER) == set(a7sim.__all__)


def test_connect_makes_the_same_instrument_of_a_scenario_as_of_its_url():
    line = 'PHOT1:LOAD "101";:PHOT2:LOAD "102";:BASE:BX 194.99;:DRIV:Z -325.71'
    seen = []
    for opened in (
        connect("akwanga", seed=7),
        connect(Scenario.load("akwanga"), seed=7),
        connect("a7sim://akwanga?seed=7"),
    ):
        with opened as client:
            client.send(line)
            seen.append(client.ask('EYEP1? "1011"'))
    assert seen[0] == seen[1] == seen[2]
    with connect("akwanga", seed=8) as other:
        other.send(line)
        assert other.ask('EYEP1? "1011"') != seen[0]


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: connect("a7sim://akwanga", seed=1), "expected no seed beside a7sim://akwanga"),
        (lambda: connect("akwanga", token="t"), "expected no token beside a scenario"),
        (lambda: connect("tcp://127.0.0.1:1"), "expected an instrument to answer there"),
        (lambda: Operator("nowhere"), "expected a scenario file or one of"),
        (lambda: Scenario.load("akwanga", {"plan.case": "F"}), "plan.case: expected"),
        (lambda: Study.load("nothing"), "expected the file of a study"),
        (lambda: Operator("schut-1956").run("tcp://127.0.0.1:5025"), "expected work at the plotter"),
    ],
)
def test_a_wrong_call_raises_an_error_of_one_sentence(call, sentence):
    with pytest.raises(A7SimError, match=sentence):
        call()


def test_a_line_that_the_instrument_refuses_raises_an_error():
    with connect("akwanga") as client:
        client.send("BASE:BX 1000")
        with pytest.raises(InstrumentError):
            client.check("BASE:BX 1000")


def test_a_study_writes_the_same_document_as_the_command(tmp_path, typed):
    study = tmp_path / "small.toml"
    study.write_text(
        'schema_version = 1\ntitle = "Small"\nquestion = "How well?"\nscenario = "akwanga"\nreplicates = 2\nseed = 1\n'
        'responses = ["strip_plan_at_checks_m"]\nsettings = { work = ["comparator"] }\n',
        encoding="utf-8",
    )
    found = Study.load(study).run(tmp_path / "out")
    code, _, err = typed("study", study, "--executor", "process", "--quiet", "--out", tmp_path / "command")
    assert code == 0, err
    by_api, by_command = (tmp_path / name / "results.json" for name in ("out", "command"))
    assert by_api.read_bytes() == by_command.read_bytes()
    assert found["cells"][0]["replicates"] == 2


def test_connect_returns_a_client():
    with connect("akwanga") as client:
        assert isinstance(client, Client)
        assert client.identity.model == "A7"
