"""docs/protocol.md: its tables equal those of the instrument, and its examples run (issue 5)."""

import contextlib
import importlib.util
import io
import re
from pathlib import Path

import pytest

from tests.support.engine_client import with_model
from tests.support.links import new_instrument, serve_on_all_links
from tests.test_language import REFUSED

ROOT = Path(__file__).parents[1]
PAGES = {
    name: (ROOT / name).read_text(encoding="utf-8")
    for name in ("docs/protocol.md", "docs/driver-guide.md", "README.md")
}
EXAMPLES = [
    (name, code) for name, page in PAGES.items() for code in re.findall(r"```python\n(.*?)```", page, re.DOTALL)
]
OF_EVERY_COMMAND = {-101, -102, -108, -113}


@pytest.fixture(scope="module")
def maker():
    spec = importlib.util.spec_from_file_location("make_protocol", ROOT / "docs" / "make_protocol.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_fresh(maker):
    assert maker.page(PAGES["docs/protocol.md"]) == PAGES["docs/protocol.md"], "run python docs/make_protocol.py"


def test_every_example_of_the_page_runs(maker):
    for command in maker.COMMANDS.commands:
        instrument = maker.Instrument("A8" if command.header.startswith("COMMon") else "A7")
        instrument.send(maker.PREPARATIONS.get(command.header, ""))
        instrument.errors()
        reply = instrument.send(maker.example_of(command)[0])
        assert command.query <= bool(reply)
        assert instrument.errors() == [], command.header


def test_the_page_names_every_error_that_a_command_can_meet(maker):
    listed = {command.header: set(maker.errors_of(command)) for command in maker.COMMANDS.commands}
    for number, lines in REFUSED.items():
        for line in lines if number not in OF_EVERY_COMMAND else ():
            client = with_model()
            client.query(line)
            found = client.errors() or [number]
            assert found == [number] or number in (-200, -221), line
            assert number in listed[header_of(maker, line)], line


def header_of(maker, line):
    mnemonics = [(name.upper(), None) for name in re.findall(r"[*A-Za-z]+", line.split()[0])]
    return maker.COMMANDS.find(mnemonics, line.split()[0].endswith("?"))[0].header


@pytest.fixture(scope="module")
def urls():
    with serve_on_all_links(new_instrument()) as opened:
        yield opened


@pytest.mark.parametrize(("page", "code"), EXAMPLES, ids=[f"{name}-{i}" for i, (name, _) in enumerate(EXAMPLES)])
def test_every_python_example_prints_the_shown_output(urls, page, code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a7.tty").symlink_to(urls["pty"])
    here = code.replace("rfc2217://127.0.0.1:2217", urls["rfc2217"]).replace("5025", urls["tcp"].rpartition(":")[2])
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(here, page, "exec"), {})
    shown = re.findall(r"print\(.*\)  # (.*)", code)
    assert shown
    assert list(dict.fromkeys(printed.getvalue().splitlines())) == shown


def test_no_example_is_left_out():
    assert len(EXAMPLES) >= 5
