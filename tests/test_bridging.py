"""Bridging: settings and readings continue from model to model, and the strip closes within its counters."""

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
    """Return a scenario of the first `models` models of the strip, with film and operator without errors.

    It has no signalised points, and no reading needs to be repeated.
    """
    scenario = without_errors(load_scenario("bridge", {"plan.parallax_readings": "1", **overrides}))
    return msgspec.structs.replace(scenario, models=scenario.models[:models], ground=[])


def bridged_strip(scenario, seeds=(1,)):
    batch = open_batch(scenario, seeds)
    return batch, list(bridge_strip_batch(batch.workstation))


def misclosures(batch, models, session=0):
    """Return the residuals ``(3, n)`` in mm of a strip after a similarity transformation to the true ground."""
    strip = strip_points([model.coordinates_of(session) for model in models])
    ground = np.array([batch.scenes[session].ground_points[name] for name in strip.points]).T
    return similarity_by_quaternion(ground, strip.coordinates).residuals


@pytest.fixture(scope="module")
def three_models():
    return bridged_strip(scenario_of(3))


def test_a_photograph_keeps_its_elements_in_the_next_model(three_models):
    """Two models that share a photograph have the same kappa, phi, omega, by and bz of it."""
    _, models = three_models
    for before, after in pairwise(models):
        n = before.model.right_projector
        assert after.model.left_projector == n
        for name in ("kappa", "phi", "omega", "by", "bz"):
            assert after.orientation.elements[f"{name}{n}"] == before.orientation.elements[f"{name}{n}"]


def test_readings_of_common_points_continue_from_model_to_model(three_models):
    """The readings of common points agree within one or two counts in each coordinate."""
    _, models = three_models
    for model in models[1:]:
        assert len(model.common) >= 3
        for difference in model.common.values():
            x, y, z = difference[:, 0]
            assert max(abs(x), abs(y), abs(z / model.z_units_per_mm)) < 0.02


def test_x_readings_continue_over_several_bases(three_models):
    """X increases by one base in each model, although the carriage ends at 280 mm."""
    _, models = three_models
    first = models[0].points["2011"][0, 0]
    assert models[-1].points["2041"][0, 0] - first == pytest.approx(3 * 194.4, abs=3.0)


def test_three_models_close_within_the_limit_for_ten(three_models):
    batch, models = three_models
    assert np.abs(misclosures(batch, models)).max() < CLOSES_MM


def test_without_the_transfer_of_scale_a_strip_does_not_close(monkeypatch):
    """The comparison can fail: without transfer of scale, changes of the flying height break the strip."""
    monkeypatch.setattr(
        bridging, "transfer_scale", lambda workstation, active, model, before: np.ones(workstation.operators.size)
    )
    batch, models = bridged_strip(scenario_of(2))
    assert len(models) == 2
    assert np.abs(misclosures(batch, models)).max() > 10.0 * CLOSES_MM


def test_by_and_bz_at_the_end_of_their_range_are_set_back_and_y_and_z_preset(monkeypatch):
    """If every photograph is set back to the zeros of by and bz, the strip still closes."""
    monkeypatch.setattr(bridging, "SHARE_OF_RANGE", 0.0)
    batch, models = bridged_strip(scenario_of(2))
    assert len(models) == 2
    for model in models[1:]:
        n = model.model.left_projector
        assert model.orientation.elements[f"by{n}"][0] == 0.0
        assert model.orientation.elements[f"bz{n}"][0] == 0.0
    assert np.abs(misclosures(batch, models)).max() < CLOSES_MM


def test_a_model_that_does_not_continue_the_strip_is_refused():
    """With the base inside twice in succession, the common photograph would have to change its projector."""
    scenario = scenario_of(2)
    again = msgspec.structs.replace(scenario.models[1], base="inside")
    batch, models = bridged_strip(msgspec.structs.replace(scenario, models=[scenario.models[0], again]))
    assert len(models) == 1
    assert "does not go on from model 1" in batch.workstation.operators.reasons[0]


@pytest.mark.slow
def test_a_bridge_is_the_same_over_the_link_and_in_a_batch():
    """With `work = ["bridge"]`, the strip on the ground and the hours are equal to the digit."""
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
def test_the_reason_for_giving_up_a_bridge_is_reported_over_the_link_and_in_a_batch(monkeypatch):
    """An operator that gives up has no strip; the document contains the reason."""
    monkeypatch.setattr(bridging, "transfer_scale", _gives_up)
    scenario = msgspec.structs.replace(scenario_of(2), work=["bridge"])
    for document in (run_all_methods(scenario, 1), *run_all_methods_batch(scenario, [1])):
        assert (document["status"], document["message"]) == ("does not fit", "no scale")
        assert "ways" not in document


def _gives_up(workstation, active, model, before):
    workstation.operators.give_up(active, "no scale")
    raise AllGaveUpError


def test_bridging_in_a_scenario_without_base_out_is_a_mistake():
    with pytest.raises(ScenarioError, match="base inside and outside in turn"):
        load_scenario("a8-strip", {"work": '["bridge"]'})


def test_a_strip_without_base_out_cannot_be_bridged():
    with pytest.raises(A7SimError, match="inside and outside in turn"):
        run_bridge(msgspec.structs.replace(load_scenario("akwanga"), models=load_scenario("akwanga").models[:1]), 1)


@pytest.mark.slow
def test_ten_models_close_on_the_truth():
    """The requirement is 0.05 mm at every point; drums turned by eye between two counts leave 0.01."""
    batch, models = bridged_strip(scenario_of(10))
    assert len(models) == 10
    assert np.abs(misclosures(batch, models)).max() < CLOSES_MM / 3.0


def test_an_orientation_that_cannot_be_checked_is_not_corrected(monkeypatch):
    """If no image can be fused at the last check, no element is corrected or set to zero."""

    def no_image_fused(workstation, active, points):
        zeros = np.zeros((len(points), workstation.operators.size))
        apart = np.full(workstation.operators.size, points[0], dtype=object)
        return Parallaxes(zeros, np.zeros((3, *zeros.shape)), apart)

    monkeypatch.setattr(Workstation, "look_at_parallaxes", no_image_fused)
    _, models = bridged_strip(scenario_of(1))
    assert abs(models[0].orientation.elements["omega2"][0] - 100.0) < 5.0
    assert abs(models[0].orientation.elements["phi2"][0] - 100.0) < 5.0


def test_a_model_without_a_common_point_on_its_left_is_refused(monkeypatch):
    scenario = scenario_of(2)
    monkeypatch.setattr(bridging, "model_coordinates", lambda workstation, model: {})
    batch, models = bridged_strip(scenario)
    assert len(models) == 1
    assert "none of its points 1, 3 and 5 was measured before" in batch.workstation.operators.reasons[0]


@pytest.mark.slow
def test_two_contradicting_parallax_readings_are_both_repeated():
    """With one reading of by' and one of by", a slip in by" is repeated too, and no operator gives up because of it."""
    settings = {"plan.parallax_readings": 1, "plan.centre_method": "scales", "observer.blunder_rate": 0.02}
    scenario = load_scenario("akwanga", settings=settings)
    batch = open_batch(msgspec.structs.replace(scenario, models=scenario.models[:1]), range(12))
    assert len(list(batch.measure_models())) == 1
    assert not any("do not agree" in why for why in batch.workstation.operators.reasons.values()), (
        batch.workstation.operators.reasons
    )


@pytest.mark.parametrize(("photo", "picture", "bridged"), [(1, "202", 0), (2, "203", 1)])
def test_an_operator_that_gives_up_a_bridge_reports_why_and_keeps_the_finished_models(
    tmp_path, photo, picture, bridged
):
    """Exit code 1, the reason in results, table and error message; no independent models."""
    result = a7sim_in_process(
        "bridge", "bridge", "--set", f"photos.{photo}.laid=upside down", "--set", "plan.parallax_readings=1",
        "--out", tmp_path / "out",
    )  # fmt: skip
    document = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
    assert (result.returncode, document["status"]) == (1, "does not fit")
    assert document["message"].startswith(f"picture {picture} lies upside down")
    assert result.stderr == f"a7sim: the operator gave up: {document['message']}\n"
    assert f"does not fit: {document['message']}" in " ".join(result.stdout.split())
    models = document["bridged"]["models"]
    assert len(models) == bridged
    for model in models:
        row = [model["model"], model["base"], f"{model['elements']['bx']:.2f}", f"{model['scale']:.5f}"]
        assert row in [line.split()[:4] for line in result.stdout.splitlines()]
    assert "independent" not in document and not (tmp_path / "out" / "independent").exists()


@pytest.fixture(scope="module")
def with_control():
    """Return a scenario of two models with standard points as control and polynomials of degree 2."""
    scenario = scenario_of(2, **{"strip.polynomial": "2"})
    (scene,) = open_batch(scenario, (1,)).scenes
    places = {name: at for name, at in scene.ground_points.items() if name in {f"{i}" for i in range(2000, 2100)}}
    ground = [
        GroundPoint(point=name, X=round(float(x), 3), Y=round(float(y), 3), Z=round(float(z), 3), role="control")
        for name, (x, y, z) in places.items()
    ]
    return msgspec.structs.replace(scenario, ground=ground)


@pytest.mark.slow
def test_the_command_compares_polynomials_with_the_similarity(monkeypatch, with_control):
    """Bridged and independent: with more unknowns, the control never fits worse. Without --out no file is written."""
    monkeypatch.setattr("a7sim.cli.run_options.resolve_scenario", lambda *_: (with_control, 1))
    result = a7sim_in_process("bridge", "bridge")
    assert (result.returncode, result.stderr) == (0, "")
    rows = {
        tuple(line.split(" 9 control ")[0].split()): line.split()
        for line in result.stdout.splitlines()
        if " 9 control " in line
    }
    for method in ("bridged", "independent"):
        by_similarity, by_polynomials = rows[method,], rows[f"{method},", "polynomial"]
        for alone, bent in zip(by_similarity[-2:], by_polynomials[-2:], strict=True):
            assert float(bent) <= float(alone) + 0.001
    assert "hours at the instrument bridging" in result.stdout
