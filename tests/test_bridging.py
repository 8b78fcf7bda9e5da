"""Bridging: what must go on from model to model does, and the strip closes as well as its counters allow."""

import json
from itertools import pairwise

import msgspec
import numpy as np
import pytest

from a7sim.errors import A7SimError
from a7sim.operator.driving.workstation import Parallaxes, Workstation
from a7sim.operator.people.operator_batch import AllGaveUpError
from a7sim.operator.procedures import bridging
from a7sim.operator.procedures.bridging import bridge_strip_batch
from a7sim.reduction import similarity_by_quaternion
from a7sim.scenario import ScenarioError, load_scenario
from a7sim.scenario.schema import GroundPoint
from a7sim.session.all_methods import run_all_methods, run_all_methods_batch
from a7sim.session.bridge import run_bridge, strip_points
from a7sim.session.session_batch import open_batch
from a7sim.study.loading import load_study
from tests.support.processes import a7sim_in_process
from tests.support.sessions import without_errors

CLOSES_MM = 0.05


def scenario_of(models, **overrides):
    """The first so many models of the strip without signalised points, film and operator without errors: so that
    nothing need be read twice."""
    scenario = without_errors(load_scenario("bridge", {"plan.parallax_readings": "1", **overrides}))
    return msgspec.structs.replace(scenario, models=scenario.models[:models], ground=[])


def worked(scenario, seeds=(1,)):
    batch = open_batch(scenario, seeds)
    return batch, list(bridge_strip_batch(batch.workstation))


def misclosures(crowd, models, session=0):
    """How far a strip ``(3, n)`` in mm lies from the true ground, carried onto it by a similarity."""
    strip = strip_points([model.coordinates_of(session) for model in models])
    ground = np.array([crowd.scenes[session].ground_points[name] for name in strip.points]).T
    return similarity_by_quaternion(ground, strip.coordinates).residuals


@pytest.fixture(scope="module")
def three():
    return worked(scenario_of(3))


def test_the_oriented_photograph_stays_as_it_is(three):
    """Kappa, phi, omega, by and bz of the photograph that two models share are the same in both."""
    _, models = three
    for before, after in pairwise(models):
        n = before.model.right_projector
        assert after.model.left_projector == n
        for name in ("kappa", "phi", "omega", "by", "bz"):
            assert after.orientation.elements[f"{name}{n}"] == before.orientation.elements[f"{name}{n}"]


def test_readings_go_on_from_model_to_model(three):
    """Common points read the same again, within a count or two in any coordinate."""
    _, models = three
    for model in models[1:]:
        assert len(model.common) >= 3
        for difference in model.common.values():
            x, y, z = difference[:, 0]
            assert max(abs(x), abs(y), abs(z / model.z_units_per_mm)) < 0.02


def test_the_strip_runs_on_over_several_bases(three):
    """X reads on by one base a model, though the carriage ends at 280 mm."""
    _, models = three
    first = models[0].points["2011"][0, 0]
    assert models[-1].points["2041"][0, 0] - first == pytest.approx(3 * 194.4, abs=3.0)


def test_three_models_close_within_what_is_asked_of_ten(three):
    crowd, models = three
    assert np.abs(misclosures(crowd, models)).max() < CLOSES_MM


def test_the_scale_is_carried_by_the_heights_of_common_points(monkeypatch):
    """The comparison can fail: without the carrying of scale the flying height's changes break the strip."""
    monkeypatch.setattr(bridging, "transfer_scale", lambda bench, active, model, before: np.ones(bench.operators.size))
    crowd, models = worked(scenario_of(2))
    assert len(models) == 2
    assert np.abs(misclosures(crowd, models)).max() > 10.0 * CLOSES_MM


def test_by_and_bz_that_run_out_are_set_back_and_y_and_z_preset(monkeypatch):
    """With every photograph set back to the zeros of by and bz the strip is the same strip."""
    monkeypatch.setattr(bridging, "SHARE_OF_RANGE", 0.0)
    crowd, models = worked(scenario_of(2))
    assert len(models) == 2
    for model in models[1:]:
        n = model.model.left_projector
        assert model.orientation.elements[f"by{n}"][0] == 0.0
        assert model.orientation.elements[f"bz{n}"][0] == 0.0
    assert np.abs(misclosures(crowd, models)).max() < CLOSES_MM


def test_models_that_do_not_go_on_are_refused():
    """Base inside twice running: the photograph to be kept would have to change its projector."""
    scenario = scenario_of(2)
    again = msgspec.structs.replace(scenario.models[1], base="inside")
    crowd, models = worked(msgspec.structs.replace(scenario, models=[scenario.models[0], again]))
    assert len(models) == 1
    assert "does not go on from model 1" in crowd.workstation.operators.reasons[0]


@pytest.mark.slow
def test_a_scenario_that_asks_for_a_bridge_gets_it_over_the_link_and_in_a_crowd():
    """`work = ["bridge"]`: the strip on the ground to the digit, and the hours, as a study reads them."""
    settings = load_study("bridging").cells[5].settings
    scenario = without_errors(load_scenario("bridge", settings=settings))
    assert scenario.work == ["bridge"]
    alone = run_all_methods(scenario, 1)
    (together,) = run_all_methods_batch(scenario, [1])
    assert alone["status"] == together["status"] == "complete"
    assert alone["operator"] == together["operator"]
    assert alone["ways"] == together["ways"]
    assert alone["ways"]["bridge"]["accuracy_m"]["checks"]["plan"] < 0.05
    assert alone["ways"]["bridge"]["joins"] == []


@pytest.mark.slow
def test_a_bridge_that_does_not_close_says_why_in_both(monkeypatch):
    """Whoever gives up has no strip, and the document says so."""
    monkeypatch.setattr(bridging, "transfer_scale", _gives_up)
    scenario = msgspec.structs.replace(scenario_of(2), work=["bridge"])
    for document in (run_all_methods(scenario, 1), *run_all_methods_batch(scenario, [1])):
        assert (document["status"], document["message"]) == ("does not fit", "no scale")
        assert "ways" not in document


def _gives_up(bench, active, model, before):
    bench.operators.give_up(active, "no scale")
    raise AllGaveUpError


def test_a_scenario_without_base_out_cannot_ask_for_a_bridge():
    with pytest.raises(ScenarioError, match="base inside and outside in turn"):
        load_scenario("a8-strip", {"work": '["bridge"]'})


def test_a_strip_without_base_out_cannot_be_bridged():
    with pytest.raises(A7SimError, match="inside and outside in turn"):
        run_bridge(msgspec.structs.replace(load_scenario("akwanga"), models=load_scenario("akwanga").models[:1]), 1)


@pytest.mark.slow
def test_ten_models_close_on_the_truth():
    """Within 0.05 mm at every point is asked; drums that are turned by eye between two counts leave 0.01."""
    crowd, models = worked(scenario_of(10))
    assert len(models) == 10
    assert np.abs(misclosures(crowd, models)).max() < CLOSES_MM / 3.0


def test_what_cannot_be_looked_at_again_stays_as_it_was_oriented(monkeypatch):
    """Where no image can be fused at the last look nothing is corrected and nothing set to zero."""

    def all_apart(bench, active, points):
        nothing = np.zeros((len(points), bench.operators.size))
        apart = np.full(bench.operators.size, points[0], dtype=object)
        return Parallaxes(nothing, np.zeros((3, *nothing.shape)), apart)

    monkeypatch.setattr(Workstation, "look_at_parallaxes", all_apart)
    _, models = worked(scenario_of(1))
    assert abs(models[0].orientation.elements["omega2"][0] - 100.0) < 5.0
    assert abs(models[0].orientation.elements["phi2"][0] - 100.0) < 5.0


def test_a_model_without_a_common_point_on_its_left_is_refused(monkeypatch):
    scenario = scenario_of(2)
    monkeypatch.setattr(bridging, "model_coordinates", lambda bench, model: {})
    crowd, models = worked(scenario)
    assert len(models) == 1
    assert "none of its points 1, 3 and 5 was measured before" in crowd.workstation.operators.reasons[0]


@pytest.mark.slow
def test_of_two_readings_that_contradict_each_other_either_may_be_the_wrong_one():
    """One reading of by' and one of by": a slip in by" is made again too, and nobody gives up for it."""
    settings = {"plan.parallax_readings": 1, "plan.centre_method": "scales", "observer.blunder_rate": 0.02}
    scenario = load_scenario("akwanga", settings=settings)
    batch = open_batch(msgspec.structs.replace(scenario, models=scenario.models[:1]), range(12))
    assert len(list(batch.measure_models())) == 1
    assert not any("do not agree" in why for why in batch.workstation.operators.reasons.values()), (
        batch.workstation.operators.reasons
    )


@pytest.mark.parametrize(("photo", "picture", "bridged"), [(1, "202", 0), (2, "203", 1)])
def test_who_gives_up_a_bridge_says_why_and_leaves_the_models_that_stand(tmp_path, photo, picture, bridged):
    """Exit code 1, the reason in results, table and complaint; nothing is worked independently."""
    said = a7sim_in_process(
        "bridge", "bridge", "--set", f"photos.{photo}.laid=upside down", "--set", "plan.parallax_readings=1",
        "--out", tmp_path / "out",
    )  # fmt: skip
    document = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
    assert (said.returncode, document["status"]) == (1, "does not fit")
    assert document["message"].startswith(f"picture {picture} lies upside down")
    assert said.stderr == f"a7sim: the operator gave up: {document['message']}\n"
    assert f"does not fit: {document['message']}" in " ".join(said.stdout.split())
    models = document["bridged"]["models"]
    assert len(models) == bridged
    for model in models:
        row = [model["model"], model["base"], f"{model['elements']['bx']:.2f}", f"{model['scale']:.5f}"]
        assert row in [line.split()[:4] for line in said.stdout.splitlines()]
    assert "independent" not in document and not (tmp_path / "out" / "independent").exists()


@pytest.fixture(scope="module")
def with_control():
    """Two models whose standard points are control, and the degree of a strip's polynomials."""
    scenario = scenario_of(2, **{"strip.polynomial": "2"})
    (scene,) = open_batch(scenario, (1,)).scenes
    places = {name: at for name, at in scene.ground_points.items() if name in {f"{i}" for i in range(2000, 2100)}}
    ground = [
        GroundPoint(point=name, X=round(float(x), 3), Y=round(float(y), 3), Z=round(float(z), 3), role="control")
        for name, (x, y, z) in places.items()
    ]
    return msgspec.structs.replace(scenario, ground=ground)


@pytest.mark.slow
def test_the_command_bridges_to_its_end_and_shows_what_polynomials_do_beside_the_similarity(monkeypatch, with_control):
    """In both ways, and with more unknowns the control never fits worse; where nothing is to be kept, nothing is."""
    monkeypatch.setattr("a7sim.cli.run_options.resolve_scenario", lambda *_: (with_control, 1))
    said = a7sim_in_process("bridge", "bridge")
    assert (said.returncode, said.stderr) == (0, "")
    rows = {
        tuple(line.split(" 9 control ")[0].split()): line.split()
        for line in said.stdout.splitlines()
        if " 9 control " in line
    }
    for way in ("bridged", "independent"):
        by_similarity, by_polynomials = rows[way,], rows[f"{way},", "polynomial"]
        for alone, bent in zip(by_similarity[-2:], by_polynomials[-2:], strict=True):
            assert float(bent) <= float(alone) + 0.001
    assert "hours at the instrument bridging" in said.stdout
