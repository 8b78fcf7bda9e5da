"""Theory beside simulation: Hallert's closed forms, the effect of counters, and the scatter of sessions."""

import math

import numpy as np
import pytest
from rich.console import Console

from a7sim.geometry import GON
from a7sim.plotters import LEAST_COUNT
from a7sim.reduction import perspective_centre
from a7sim.scenario import load_scenario
from a7sim.session.session_batch import open_batch
from a7sim.study import theory
from a7sim.study.findings import findings_document
from a7sim.study.loading import build_study
from a7sim.study.page import study_page
from a7sim.study.tables import study_tables
from a7sim.study.tally import Tally
from a7sim.study.theory import (
    ROUNDING,
    centre_sds,
    element_errors,
    predicted_sd,
    quantised_error,
    reading_sd,
    theory_comparison,
    theory_limits,
)
from tests.support.html_pages import Page

QUIET = {
    "film.shrinkage_sigma_ppm": 0.0,
    "film.shear_sigma_ppm": 0.0,
    "observer.last_digit_slip": 0.0,
    "observer.blunder_rate": 0.0,
    "plan.tolerated_centre_rms": 5.0,
    "models": [{"name": "1", "left": "101", "right": "102", "base": "inside"}],
}
PERFECT_BUT_FOR_PARALLAX = {"film.irregular_um": 0.0, "film.identification_um": 0.0, "observer.fiducial_um": 0.0}


def quiet(**others):
    return load_scenario("akwanga", settings=QUIET | {path.replace("__", "."): each for path, each in others.items()})


def test_without_counters_theory_equals_hallerts(monkeypatch):
    """Six points, dependent: variances of by 2/3 + h^2/d^2 + 3 h^4/(4 d^4), kappa 2/(3 b^2),
    phi h^2/(b^2 d^2), omega 3 h^2/(4 d^4), bz h^2/(2 d^2)."""
    monkeypatch.setattr(theory, "ROUNDING", 0.0)
    monkeypatch.setattr(theory, "quantised_error", lambda fraction, sd: (1.0, 0.0))
    scenario = load_scenario("akwanga", settings=QUIET | PERFECT_BUT_FOR_PARALLAX | {"plan.method": "dependent"})
    plan = scenario.plan
    b, h = plan.bx, plan.projection_height
    d = plan.half_width * h / scenario.camera.c
    found, unit = element_errors(scenario, 0), reading_sd(scenario)
    closed = {
        "kappa2": math.sqrt(2.0 / 3.0) / b / GON,
        "phi2": h / (b * d) / GON,
        "omega2": math.sqrt(3.0) * h / (2.0 * d**2) / GON,
        "bz2": h / (math.sqrt(2.0) * d),
        "by2": math.sqrt(2.0 / 3.0 + h**2 / d**2 + 3.0 * h**4 / (4.0 * d**4)),
    }
    for name, cofactor in closed.items():
        assert found.sd(name) == pytest.approx(unit * cofactor, rel=0.01), name
    assert found.sd("omega1") is None


@pytest.mark.parametrize(("fraction", "sd"), [(0.5, 0.001), (0.2, 0.0004), (0.43, 0.002), (0.9, 0.02), (0.0, 0.005)])
def test_a_count_absorbs_an_error_at_the_rate_of_drawn_errors(fraction, sd):
    errors = sd * np.random.default_rng(7).standard_normal(400_000)
    shown = LEAST_COUNT * np.round((LEAST_COUNT * fraction + errors) / LEAST_COUNT)
    gain, added = quantised_error(fraction, sd)
    assert gain * sd**2 == pytest.approx(np.cov(shown, errors)[0, 1], abs=0.01 * LEAST_COUNT * sd)
    assert (gain * sd) ** 2 + added == pytest.approx(shown.var(), abs=0.01 * LEAST_COUNT**2)


def test_the_fraction_of_a_count_has_no_effect_for_large_errors():
    assert quantised_error(0.3, 3.0 * LEAST_COUNT) == pytest.approx((1.0, ROUNDING**2), rel=1e-3)


def test_centres_from_two_levels_scatter_as_drawn_pointings_do():
    """The thesis's T0 = 13.5 or so, 4900 and 5100, six points: within 3 % of 20,000 centres from pointings."""
    scenario = quiet()
    plan, c = scenario.plan, scenario.camera.c
    depths = plan.projection_height - (np.array(plan.centre_levels) - 5000.0) / 8.0
    width = plan.half_width * plan.projection_height / c
    points = np.array([(x * plan.bx, y * width) for y in (0.0, 1.0, -1.0) for x in (0.0, 1.0)]).T[..., None]
    rng = np.random.default_rng(1)
    low, high = (
        np.round(points * depth / plan.projection_height + 4e-3 * depth / c * rng.standard_normal((2, 6, 20_000)), 2)
        for depth in depths
    )
    found = perspective_centre(low, high, *plan.centre_levels)
    assert float(found.T0.mean()) == pytest.approx(13.5, abs=1.0)
    spreads = [each.std() for each in (found.X0, found.Y0, found.Z0)]
    np.testing.assert_allclose(centre_sds(scenario), spreads, rtol=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["independent", "dependent"])
def test_sessions_scatter_as_theory_predicts_and_not_as_least_squares_alone(method):
    """Equal within the uncertainty of 150 sessions (a quarter); least squares of free parallaxes differs by more."""
    scenario = quiet(plan__method=method, plan__centre_method="scales")
    documents = open_batch(scenario, range(150)).run()
    predicted = element_errors(scenario, 0)
    ratios = {}
    for name in predicted.names:
        found = [each["models"][0]["truth"]["element_differences"][name] for each in documents]
        ratios[name] = np.std(found, ddof=1) / predicted.sd(name)
    assert all(0.75 < ratio < 1.25 for ratio in ratios.values()), ratios


def test_responses_without_a_theory_have_no_prediction():
    element = "models.0.truth.element_differences.kappa2"
    assert predicted_sd(quiet(), element) > 0.0
    assert predicted_sd(quiet(), "models.7.truth.element_differences.kappa2") is None
    assert predicted_sd(quiet(), "models.0.truth.element_differences.by1") is None
    assert predicted_sd(quiet(), "hours") is None
    assert predicted_sd(quiet(plan__procedure="empirical"), element) is None
    assert predicted_sd(quiet(plan__centre_method="scales"), "centre_X_error") is None
    assert predicted_sd(load_scenario("a8-strip"), "centre_X_error") is None
    assert theory_comparison(quiet(), "hours", 1.0, 1.0) == {}


def test_an_rms_is_compared_by_its_quadratic_mean_and_a_difference_by_its_standard_deviation():
    X, _, _ = centre_sds(quiet())
    assert theory_comparison(quiet(), "centre_X_error", 0.6 * X, 0.8 * X)["ratio"] == pytest.approx(1.0)
    name = "models.0.truth.centre_differences.left.X0"
    assert theory_comparison(quiet(), name, 0.6 * X, 0.8 * X)["ratio"] == pytest.approx(0.8)


def test_omissions_of_the_theory_are_reported():
    assert theory_limits(quiet()) == []
    worn = quiet(instrument__condition="worn", film__shear_sigma_ppm=10.0, observer__blunder_rate=0.01)
    assert [each.split()[0] for each in theory_limits(worn)] == ["film", "faults", "slips,"]


def studied(folder):
    """Return the document of three replicates of two cells."""
    raw = {
        "schema_version": 1,
        "title": "t",
        "question": "q",
        "scenario": "akwanga",
        "factor": [{"name": "case", "path": "plan.case", "levels": ["A", "E"]}],
        "responses": ["centre_Z_error", "hours"],
        "replicates": 3,
    }
    loaded = build_study(raw, folder)
    tally = Tally.empty(2, 2)
    for cell in range(2):
        tally.add(cell, np.array([[0.9, 1.0, 1.1], [9.0, 8.0, 7.0]]))
    return findings_document(loaded, tally)


def test_a_study_has_theory_in_its_document_and_on_its_page(tmp_path):
    document = studied(tmp_path)
    spread = document["cells"][0]["responses"]["centre_Z_error"]
    assert spread["ratio"] == pytest.approx(math.hypot(1.0, 0.1) / spread["theory"])
    assert "theory" not in document["cells"][0]["responses"]["hours"]
    assert "It leaves out film that shrinks unevenly" in document["theory"]
    page = Page(study_page(document))
    assert page.table("Means, standard deviations and quantiles").rows[0][-1] == f"{spread['ratio']:.4g}"


def test_a_study_prints_the_prediction_of_theory_and_the_ratio_to_it(tmp_path):
    document = studied(tmp_path)
    console = Console(width=250)
    with console.capture() as printed:
        console.print(study_tables(document))
    text = " ".join(printed.get().split())
    assert " ".join(document["theory"].split()) in text
    spread = document["cells"][0]["responses"]["centre_Z_error"]
    assert f"{spread['theory']:.3g} {spread['ratio']:.3g}" in text
