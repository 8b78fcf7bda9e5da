"""A script of release 0.1.0 runs: each public name that has changed still works and warns."""

import subprocess
import sys

import pytest

import a7sim
from a7sim import Autograph, Scenario, reduction

SCRIPT = """
from a7sim import (
    Autograph, Client, InstrumentRefused, Mistake, Operator, Scenario, Study, computing, connect, reduction,
)

with connect("akwanga", seed=7) as client:
    client.send('PHOT1:LOAD "101";:PHOT2:LOAD "102";:BASE:BX 194.99;:DRIV:Z -325.71')
    print(client.numbers("COUN?"))
    try:
        client.send("BASE:BX 9999")
        client.check("bx")
    except InstrumentRefused as refused:
        print(len(refused.errors))
with Client.open("a7sim://akwanga") as client:
    client.send("BASE:BX 194.99")
    print(client.numbers("BASE:BX?"))
try:
    Scenario.load("no-such-scenario")
except Mistake as mistake:
    print(str(mistake).splitlines()[0][:8])
results = Operator("dewitt-pair", seed=7).work()
print(results["status"], [model["model"] for model in results["models"]])
study = Study.load("levels", replicates=2)
print(study.laid.study.design, len(study.laid.cells))
plotter = Autograph.of_scenario(Scenario.load("akwanga"), seed=7)
plotter.load(1, "101")
plotter.set_element("bx", 194.994)
plotter.wheel("X", 1.5)
state = plotter.state()
plotter.register_again(state)
print(plotter.element("bx"), sorted(plotter.time_taken()))
print(computing.Outcome.__name__, computing.written.__name__)
print(reduction.Stand.__name__, reduction.PlateLie.__name__, reduction.PictureLie.__name__)
print(reduction.adjusted.__name__, reduction.plate_lie.__name__, reduction.picture_lie.__name__)
"""
"""The ten public names of release 0.1.0, used as on its page of the Python API."""

PRINTED = """\
[0.0, 0.0, -325.71]
1
[194.99]
no-such-
complete ['1']
full 7
194.99 ['X', 'bx', 'carrier 1']
ProcessingResult write_result
ProjectorPose PlatePlacement PicturePlacement
solve_least_squares plate_placement picture_placement
"""

WARNED = (
    *("a7sim.InstrumentRefused is now called a7sim.InstrumentError", "a7sim.Mistake is now called a7sim.A7SimError"),
    *("a7sim.computing is now called a7sim.processing", "Operator.work is now called Operator.run"),
    *("Study.laid is now called Study.loaded", "Autograph.of_scenario is now called Autograph.from_scenario"),
    "Autograph.wheel is now called Autograph.turn_handwheel",
    "Autograph.time_taken is now called Autograph.pop_travel_times",
    "Autograph.register_again is now called Autograph.restore_registrations",
    "a7sim.reduction.Stand is now called a7sim.reduction.ProjectorPose",
)


def test_a_script_of_the_first_release_runs_and_warns(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    ran = subprocess.run([sys.executable, "-W", "always", script], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout) == (0, PRINTED), ran.stderr
    assert [each for each in WARNED if each not in ran.stderr] == []
    assert f"{script}:" in ran.stderr


@pytest.mark.parametrize("name", ["Mistake", "InstrumentRefused"])
def test_an_old_name_warns_once_and_is_no_public_name(name):
    with pytest.warns(FutureWarning, match=f"a7sim.{name} is now called") as warned:
        getattr(a7sim, name)
    assert len([each for each in warned if f"a7sim.{name} is" in str(each.message)]) == 1
    assert name not in a7sim.__all__


def test_an_old_class_method_works_on_the_class():
    scenario = Scenario.load("akwanga")
    with pytest.warns(FutureWarning, match=r"Autograph\.of is now called Autograph\.from_parts"):
        plotter = Autograph.of(scenario.instrument, {}, 7)
    assert plotter.element("bx") == Autograph.from_parts(scenario.instrument, {}, 7).element("bx")


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = a7sim.nothing
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = reduction.nothing
