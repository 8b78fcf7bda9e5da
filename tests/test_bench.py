"""All benchmarks run together and are reported in one form; a failing one does not stop the others (issue 10)."""

import datetime
import os
import re
from pathlib import Path

import pytest

from tests.support.benchmark_programs import BENCHMARKS, benchmark

figures, bench, bench_page = (benchmark(name) for name in ("figures", "bench", "bench_page"))
Figure, Target = figures.Figure, figures.Target

RECORDED = """\
{"name":"COUN:X?","value":30214.7,"unit":"round trips/s","against":"echo, asyncio","ratio":1.07,\
"target":{"sense":"at least","limit":0.8,"of":"ratio"}}
{"name":"a pair of many","value":7.25,"unit":"us","against":"poselib","ratio":null,\
"target":{"sense":"at least","limit":10,"of":"ratio"}}
{"name":"one pair alone","value":553.0,"unit":"us","against":"","ratio":null,\
"target":{"sense":"below","limit":300,"of":"value"}}
{"name":"a8, rms in x","value":15.8,"unit":"cm","against":"paper P","ratio":1.05,\
"target":{"sense":"between","limit":[0.667,1.333],"of":"ratio"}}
{"name":"memory","value":254,"unit":"MB"}
"""

SURROUNDINGS = {
    "date": datetime.date(2026, 11, 22),
    "processors": 2,
    "kind": "Linux on x86_64",
    "versions": (("CPython", "3.11.7"), ("numpy", "2.4.6")),
}

HELPERS = {"echoes", "round_trips", "bench", "mutants"}
"""Programs that measure nothing alone, or that measure the tests."""


def page_of(*outcomes, load=0.1, full=False):
    return bench_page.page(outcomes, bench_page.Surroundings(**SURROUNDINGS, load=load), "make bench", full)


def rows_of(page):
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in page.splitlines() if line[:1] == "|"][2:]


def test_every_program_that_measures_is_in_the_table_of_bench():
    programs = {path.stem: path.read_text(encoding="utf-8") for path in BENCHMARKS.glob("*.py")}
    measuring = {name for name, text in programs.items() if '__name__ == "__main__"' in text} - HELPERS
    assert measuring == {each.program for each in bench.BENCHMARKS}
    assert [name for name in measuring if "    tell(main)\n" not in programs[name]] == []


def test_every_program_that_measures_is_in_the_readme():
    readme = (BENCHMARKS / "README.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"^\| `(\w+)\.py`", readme, re.M))
    assert listed == {each.program for each in bench.BENCHMARKS} | {"bench"}


def test_quick_settings_end_in_minutes_and_take_no_longer_than_full_settings():
    assert sum(each.quick.seconds for each in bench.BENCHMARKS) < 15 * 60
    assert all(each.quick.seconds <= each.full.seconds for each in bench.BENCHMARKS)


def test_recorded_figures_survive_writing_and_reading():
    recorded = figures.read(RECORDED)
    assert figures.read(figures.written(recorded)) == recorded


def test_a_page_has_a_row_for_each_recorded_figure():
    page = page_of(bench_page.Outcome("links", "--rounds 20", tuple(figures.read(RECORDED)), 21.0))
    assert rows_of(page) == [
        ["`links.py`", "COUN:X?", "30215 round trips/s", "echo, asyncio", "1.07", "ratio at least 0.8", "met"],
        ["`links.py`", "a pair of many", "7.25 us", "poselib", "not there", "ratio at least 10", ""],
        ["`links.py`", "one pair alone", "553 us", "", "", "below 300", "**missed**"],
        ["`links.py`", "a8, rms in x", "15.8 cm", "paper P", "1.05", "ratio between 0.667 and 1.33", "met"],
        ["`links.py`", "memory", "254 MB", "", "", "", ""],
    ]
    assert "Of 5 figures, 2 meet their target and 1 miss it; benchmarks that failed: 0." in page
    assert "2026-11-22, 2 processors, Linux on x86_64; CPython 3.11.7, numpy 2.4.6." in page
    assert "python benchmarks/links.py --rounds 20\n" in page


def test_a_page_names_failed_benchmarks_and_absent_libraries():
    failed = bench_page.Outcome("killed", "20", failure="expected a|b, got <nothing>")
    absent = bench_page.Outcome("fuzz_guided", "", absent="atheris")
    page = page_of(failed, absent)
    assert r"| `killed.py` | failed: expected a\|b, got &lt;nothing> |" in page
    assert "| `fuzz_guided.py` |  |  | atheris | not there |" in page
    assert "benchmarks that failed: 1." in page


def test_a_page_states_whether_other_programs_were_running_and_which_settings_were_used():
    assert "Taken beside other work" in page_of(load=1.8)
    assert "Taken beside other work" not in page_of(load=0.1)
    assert "quick settings" in page_of()
    assert "quick settings" not in page_of(full=True)


@pytest.mark.parametrize(
    ("arguments", "command", "settings"),
    [
        ("", "make bench", "--seconds 10"),
        ("--quick --only clients run", "make bench BENCH='--only clients run'", "--seconds 10"),
        ("--full --peers /some/where", "make bench BENCH='--full --peers DIR'", ""),
    ],
)
def test_a_page_names_the_command_that_reproduces_it(arguments, command, settings):
    given = bench.options(arguments.split())
    chosen = {each.program: used.arguments for each, used in bench.chosen_by(given)}
    assert bench.command_of(given) == command
    assert chosen["clients"] == settings
    assert set(chosen) == set(given.only or [each.program for each in bench.BENCHMARKS])


def test_a_page_contains_neither_the_name_nor_a_path_of_the_machine():
    page = bench_page.page([bench_page.Outcome("run", "")], bench_page.Surroundings.here(), "make bench", False)
    assert os.uname().nodename not in page
    assert str(BENCHMARKS.parent) not in page


@pytest.mark.parametrize(
    ("target", "meets", "misses"),
    [
        (("at least", 0.8), 0.8, 0.79),
        (("above", 1), 1.01, 1.0),
        (("at most", 5), 5.0, 5.01),
        (("below", 60), 59.9, 60.0),
        (("between", (0.5, 1.5)), 1.5, 1.51),
    ],
)
def test_a_target_is_met_up_to_its_limit(target, meets, misses):
    assert Figure("", meets, target=Target(*target)).met is True
    assert Figure("", misses, target=Target(*target)).met is False
    assert Figure("", misses, against="floor", ratio=meets, target=Target(*target, "ratio")).met is True


@pytest.fixture
def run_program(monkeypatch, tmp_path):
    """Return a function that runs a program text beside `figures` and returns its outcome."""
    monkeypatch.setattr(bench, "HERE", tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(BENCHMARKS), os.environ.get("PYTHONPATH", "")]))

    def outcome(text, arguments=""):
        (tmp_path / "made.py").write_text(text, encoding="utf-8")
        settings = bench.Settings(arguments, 1)
        return bench.outcome(bench.Benchmark("made", settings, settings), settings, None)

    return outcome


def test_a_benchmark_with_a_missed_target_or_printed_text_does_not_fail(run_program):
    result = run_program(
        "import os, sys\n"
        "from figures import Figure, Target, tell\n"
        "def main():\n"
        "    print('for people')\n"
        "    os.system('echo from elsewhere')\n"
        "    return [Figure(' '.join(sys.argv[1:]), 2.0, target=Target('below', 1))]\n"
        "tell(main)\n",
        "--rounds 3",
    )
    assert result.failure == ""
    assert result.figures == (Figure("--rounds 3", 2.0, target=Target("below", 1)),)
    assert result.summary.endswith("0 met, 1 missed")


def test_a_failed_benchmark_is_reported_with_its_last_words(run_program):
    assert run_program("raise SystemExit('expected a port, got none')").failure == "expected a port, got none"
    assert run_program("raise SystemExit(3)").failure == "exit code 3, and nothing said"


def test_a_benchmark_over_its_time_limit_is_ended_with_its_child_processes(run_program, monkeypatch, tmp_path):
    monkeypatch.setattr(bench.Settings, "longest", 2.0)
    monkeypatch.setattr(bench, "SECONDS_TO_END", 0.5)
    result = run_program(
        "import subprocess, pathlib, time\n"
        "child = subprocess.Popen(['sleep', '60'])\n"
        f"pathlib.Path({str(tmp_path / 'child')!r}).write_text(str(child.pid))\n"
        "time.sleep(60)\n"
    )
    assert result.failure == "not done after 2 s"
    child = int((tmp_path / "child").read_text())
    assert has_ended(child)


def has_ended(process):
    """Return whether a process has ended; a zombie counts as ended."""
    try:
        return Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0] in "ZX"
    except FileNotFoundError:
        return True
