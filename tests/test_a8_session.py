"""The operator at an A8: no by for parallaxes, scales in units of two millimetres, the base always inside."""

import numpy as np
import pytest

from a7sim.operator import OperatorGaveUp, measure_models
from a7sim.scenario import ScenarioError, load_scenario
from a7sim.session import open_session, run
from tests.support.sessions import without_errors
from tests.test_session_batch import SEEDS, same_to_the_digit


def a8(**settings):
    return load_scenario("akwanga-a8", {"instrument.condition": "{}", **settings})


@pytest.fixture(scope="module")
def results_without_errors():
    return run(without_errors(a8()), 3)


def test_without_errors_the_strip_returns_the_ground_within_the_resolution_of_the_scales(results_without_errors):
    """0.01 of a 2-mm unit is 0.08 m on the ground at 1:4046; 0.01 gon at 300 mm is a twentieth of a millimetre."""
    strip = results_without_errors["strip"]
    residuals = np.array([[each[axis] for axis in "XYZ"] for each in strip["residuals_m"].values()])
    assert np.abs(residuals).max() < 0.3
    assert np.sqrt((residuals**2).mean()) < 0.1
    assert strip["joins"][0]["max_residual_mm"] < 0.12


def test_centres_have_the_scale_readings_of_the_paper(results_without_errors):
    """P 3.1: the base line at Y = 200.00, the left centre at X = 200.00 - B/4."""
    for model in results_without_errors["models"]:
        left, right = (model["perspective_centres"][side] for side in ("left", "right"))
        assert left["X0"] == pytest.approx(200.0 - 180.0 / 4.0, abs=0.04)
        assert right["X0"] == pytest.approx(200.0 + 180.0 / 4.0, abs=0.04)
        assert (left["Y0"], right["Y0"]) == pytest.approx((200.0, 200.0), abs=0.04)


def test_a_model_lists_the_elements_of_an_a8(results_without_errors):
    elements = results_without_errors["models"][0]["relative_orientation"]["elements"]
    assert set(elements) == {"kappa1", "kappa2", "phi1", "phi2", "omega1", "omega2", "c1", "c2", "bx"}


def test_the_operator_gives_up_numerical_orientation_because_an_a8_has_no_by():
    session = open_session(a8(**{"plan.procedure": '"numerical"'}), 1)
    with pytest.raises(OperatorGaveUp, match="an A8 has no by' and by\" to measure parallaxes with"):
        list(measure_models(session.person, session.job))


def test_a_base_outside_is_a_mistake_in_a_scenario_for_an_a8():
    with pytest.raises(ScenarioError, match=r"models\[1\].base: expected 'inside', all that an A8 has, got 'outside'"):
        a8(**{"models.1.base": '"outside"'})


@pytest.mark.parametrize("condition", ["{}", '"serviced"'])
def test_a_batch_at_a8s_reads_and_sets_the_same_as_each_session_alone(condition):
    assert same_to_the_digit(a8(**{"instrument.condition": condition}), looked_at=SEEDS[1:])
