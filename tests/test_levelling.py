"""Absolute orientation at the instrument: the model comes level and to scale, stays oriented, and is set back."""

import msgspec
import numpy as np
import pytest

from a7sim.geometry import GON, rotation
from a7sim.operator.driving.job import ModelJob
from a7sim.operator.procedures.levelling import MAX_ROUNDS, levelled_by_all_elements, levelled_by_common_phi
from a7sim.plotters import A7, A8
from a7sim.report.session_tables import session_tables
from a7sim.scenario import load_scenario
from a7sim.session.session_batch import open_batch
from a7sim.session.truth import RelativePose
from tests.support.sessions import without_errors

A_COUNT_OF_HEIGHT_M = 0.01
HALF_A_COUNT_GON = 0.005
REACH_MM = 260.0
"""From the middle of a model to its furthest control."""


def scenario_of(**overrides):
    """Akwanga's first model, oriented empirically, levelled and scaled at the instrument."""
    plan = {"plan.absolute_orientation": "true", "plan.procedure": '"empirical"'}
    scenario = load_scenario("akwanga", plan | overrides)
    return msgspec.structs.replace(scenario, models=scenario.models[:1])


def levelled(scenario, seed=1):
    batch = open_batch(scenario, [seed])
    (record,) = batch.measure_models()
    return batch, record.for_session(0)


@pytest.fixture(scope="module")
def without_any_error():
    return levelled(without_errors(scenario_of()))


def test_without_any_error_heights_at_control_agree_within_one_unit_of_the_counter(without_any_error):
    """0.01 m by gear Cd, as the counter shows what is given; 0.02 % of the flying height, 0.24 m, are tolerated."""
    found = without_any_error[1].on_ground
    assert found.tolerated == pytest.approx(2e-4 * 1221.4, rel=1e-3)
    assert max(abs(round(each, 2)) for each in found.heights.values()) <= A_COUNT_OF_HEIGHT_M


def test_after_numerical_orientation_heights_agree_within_a_third_of_the_tolerance():
    """Numerical relative orientation sets its elements by their counters: what they round away deforms the model."""
    found = levelled(without_errors(scenario_of(**{"plan.procedure": '"numerical"'})))[1].on_ground
    assert A_COUNT_OF_HEIGHT_M < max(map(abs, found.heights.values())) < found.tolerated / 3.0


def test_the_counter_reads_metres_at_the_scale_of_its_gear(without_any_error):
    """Gear Cd at 1:3750, as the thesis has it; distances fit within a count of bx, 5e-5 of the length."""
    found = without_any_error[1].on_ground
    assert (found.scale_number, found.height_gear) == (3750.0, "Cd")
    assert abs(found.distance) < 1200.0 * 5e-5


def test_checks_can_then_be_read_in_ground_units(without_any_error):
    batch, record = without_any_error
    checks = [name for name in record.on_ground.points if name.startswith("K")]
    assert len(checks) >= 2
    for name in checks:
        assert record.on_ground.points[name][2] == pytest.approx(batch.scenes[0].ground_points[name][2], abs=0.2)


def test_the_relative_orientation_is_untouched_but_for_rounding(without_any_error):
    """What the counters describe, before and while level: rotation and base the same within two counts."""
    record = without_any_error[1]
    before, meanwhile = (
        RelativePose.from_counters(each, record.model, A7)
        for each in (record.on_ground.before, record.on_ground.elements)
    )
    assert max(before.differences_gon(meanwhile)) < 0.02
    assert record.on_ground.elements["phi1"] != record.on_ground.before["phi1"]


def test_afterwards_the_instrument_has_its_former_settings(without_any_error):
    """Elements, gear and counters: the instrument reads a point as it read it before."""
    batch, record = without_any_error
    workstation, active = batch.workstation, batch.workstation.operators.active
    shown = workstation.controls.elements(active, list(record.on_ground.before))
    assert {name: each[0] for name, each in shown.items()} == record.on_ground.before
    assert workstation.controls.units_per_mm == record.z_units_per_mm == 8.0
    again = workstation.measure_points(active, ["K1"])[:, 0, 0]
    assert again == pytest.approx(record.points["K1"], abs=0.015)


def test_an_operator_with_errors_levels_within_the_tolerance():
    (document,) = open_batch(scenario_of(), [7]).run()
    found = document["models"][0]["absolute_orientation"]
    assert found["agrees"]
    assert 2 <= len(found["rounds"]) <= MAX_ROUNDS + 1
    assert found["rounds"][0]["height_rms_m"] > 10.0 * found["rounds"][-1]["height_rms_m"]
    session_tables(document)


def test_an_a8_is_levelled_by_its_own_elements():
    """Common Phi, equal changes of omega as far as counters show, and the base; everything else stays."""
    a8 = {"instrument.variant": '"A8"', "models.1.base": '"inside"', "plan.procedure": '"empirical"'}
    found = levelled(without_errors(scenario_of(**a8)))[1].on_ground
    assert found.within_tolerance
    changes = {name: value - found.before[name] for name, value in found.elements.items()}
    assert {name for name, change in changes.items() if abs(change) > 1e-9} == {"common_phi", "omega1", "omega2", "bx"}
    assert changes["omega1"] == pytest.approx(changes["omega2"], abs=0.0101)


def test_a_model_with_too_little_control_is_not_levelled():
    """Two heights do not level a model: nothing is turned, and the session continues."""
    scenario = without_errors(scenario_of())
    ground = [
        msgspec.structs.replace(p, role="control" if p.point in ("C1", "C2") else "check") for p in scenario.ground
    ]
    batch, record = levelled(msgspec.structs.replace(scenario, ground=ground))
    assert record.on_ground is None
    assert batch.workstation.operators.reasons == {}


SETTINGS = {
    "kappa1": 1.2, "kappa2": 399.3, "phi1": 100.8, "phi2": 99.1, "omega1": 99.4, "omega2": 101.3,
    "by1": 0.4, "by2": -1.3, "bz1": 0.7, "bz2": -2.1, "bx": 190.0,
}  # fmt: skip


@pytest.mark.parametrize("base", ["inside", "outside"])
@pytest.mark.parametrize("lean", [(0.01, -0.02), (-0.05, 0.03)])
def test_both_projectors_and_the_base_turn_together(base, lean):
    """Rotations stay to the last digits, the base within the hundredths that bz' and bz" share; up is up to a count."""
    model = ModelJob("1", "a", "b", base, "positive", {})
    up = np.array([*lean, np.sqrt(1.0 - lean[0] ** 2 - lean[1] ** 2)])[:, None]
    turned = levelled_by_all_elements(
        {name: np.array([v]) for name, v in SETTINGS.items()}, model, A7, up, np.array([1.01])
    )
    after = SETTINGS | {name: float(each[0]) for name, each in turned.items()}
    rotations, bases = RelativePose.from_counters(SETTINGS, model, A7).differences_gon(
        RelativePose.from_counters(after, model, A7)
    )
    assert rotations < 1e-9
    assert bases < 0.002
    n = model.left_projector
    turn = _stand(after, n) @ _stand(SETTINGS, n).T @ up[:, 0]
    assert np.hypot(turn[0], turn[1]) / GON < 2.0 * HALF_A_COUNT_GON


def _stand(settings, n):
    omega, phi = ((settings[f"{name}{n}"] - 100.0) * GON for name in ("omega", "phi"))
    return rotation(omega, phi, settings[f"kappa{n}"] * GON)


@pytest.mark.parametrize("common", [100.0, 101.5])
def test_a_common_phi_and_equal_omegas_do_the_same(common):
    """By what the manual lists: no bz there, but a common Phi about the Y axis outside of omega."""
    settings = {"common_phi": common, "omega1": 100.3, "omega2": 99.6, "bx": 190.0}
    model = ModelJob("1", "a", "b", "inside", "positive", {})
    up = np.array([0.02, -0.03, np.sqrt(1.0 - 0.0013)])[:, None]
    turned = levelled_by_common_phi(
        {name: np.array([v]) for name, v in settings.items()}, model, A8, up, np.array([1.01])
    )
    assert set(turned) <= set(A8.elements)
    before, after = ((phi - 100.0) * GON for phi in (common, float(turned["common_phi"][0])))
    omegas = [float(turned[name][0]) - settings[name] for name in ("omega1", "omega2")]
    assert omegas[0] == pytest.approx(omegas[1])
    whole = rotation(0.0, after, 0.0) @ rotation(omegas[0] * GON, 0.0, 0.0) @ rotation(0.0, -before, 0.0)
    assert np.hypot(*(whole @ up[:, 0])[:2]) / GON < HALF_A_COUNT_GON + 1e-9
    assert turned["bx"][0] == pytest.approx(191.9)
