"""Main effects of the factors of a Latin hypercube: shares and slopes of models with a known answer."""

import numpy as np
import pytest
from scipy.stats import qmc

from a7sim.study.cells import make_cells
from a7sim.study.findings import findings_document
from a7sim.study.loading import build_study
from a7sim.study.main_effects import MIN_CELLS, main_effects, noise_share
from a7sim.study.page import study_page
from a7sim.study.tables import study_tables
from a7sim.study.tally import Tally
from tests.support.html_pages import Page


def a_hypercube(cells, factors, seed=1):
    return qmc.LatinHypercube(d=factors, rng=seed).random(cells).T


def by_name(means, values):
    return {each.factor: each for each in main_effects(means, values)}


def test_the_shares_of_an_additive_model_equal_those_of_its_variances():
    """y = 3 u - 2 v + w of uniform u, v, w: shares 9/14, 4/14 and 1/14, within their intervals."""
    u, v, w = a_hypercube(1000, 3)
    found = by_name(3.0 * u - 2.0 * v + w, {"u": u, "v": v, "w": w})
    for name, share in (("u", 9 / 14), ("v", 4 / 14), ("w", 1 / 14)):
        assert found[name].share == pytest.approx(share, abs=0.04)
        low, high = found[name].interval
        assert low <= share <= high
    assert found["u"].slope > 0.0 > found["v"].slope
    assert max(each.p for each in found.values()) < 1e-6


def test_ishigamis_function_has_its_first_order_indices():
    """sin x1 + 7 sin^2 x2 + 0.1 x3^4 sin x1: 0.3139, 0.4424 and 0; the second has a share but no slope of ranks."""
    x = np.pi * (2.0 * a_hypercube(2000, 3) - 1.0)
    means = np.sin(x[0]) + 7.0 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])
    found = by_name(means, {"x1": x[0], "x2": x[1], "x3": x[2]})
    assert found["x1"].share == pytest.approx(0.3139, abs=0.04)
    assert found["x2"].share == pytest.approx(0.4424, abs=0.05)
    assert found["x3"].share < 0.02
    assert abs(found["x2"].slope) < 0.1


def test_a_factor_without_effect_is_seldom_significant():
    """With 200 seeds about one in twenty has p < 0.05, and the interval of its share nearly always contains zero."""
    effects = []
    for seed in range(200):
        u, v = a_hypercube(40, 2, seed)
        effects.append(by_name(np.random.default_rng(seed).standard_normal(40) + 5.0 * u, {"u": u, "v": v})["v"])
    assert 0.01 < np.mean([each.p < 0.05 for each in effects]) < 0.10
    assert np.mean([each.interval[0] == 0.0 for each in effects]) > 0.85


def test_levels_without_order_have_a_share_and_no_slope():
    (u,) = a_hypercube(60, 1)
    kinds = np.array(["A", "B", "C"])[(3.0 * u).astype(int)]
    found = by_name(np.where(kinds == "B", 1.0, 0.0), {"kind": list(kinds)})
    assert found["kind"].share == pytest.approx(1.0)
    assert np.isnan(found["kind"].slope)


def test_cells_without_a_number_are_excluded_and_too_few_cells_have_no_main_effects():
    u, v = a_hypercube(50, 2)
    means = u.copy()
    means[::5] = np.nan
    kept = np.isfinite(means)
    assert main_effects(means, {"u": u, "v": v}) == main_effects(means[kept], {"u": u[kept], "v": v[kept]})
    assert main_effects(u[: MIN_CELLS - 1], {"u": u[: MIN_CELLS - 1]}) == []
    assert main_effects(np.ones(50), {"u": u}) == []


def test_chance_is_the_scatter_of_means_of_few_replicates_without_common_random_numbers():
    rng = np.random.default_rng(2)
    cells, common = np.linspace(0.0, 1.0, 400)[:, None], 50.0 * rng.standard_normal(10)
    values = cells + common + 0.5 * rng.standard_normal((400, 10))
    expected = 0.025 / (np.var(cells, ddof=1) + 0.025)
    assert noise_share(values) == pytest.approx(expected, rel=0.1)
    assert np.isnan(noise_share(values[:, :1]))


def test_a_hypercube_is_reported_in_words_tables_and_a_page(tmp_path):
    """Starting from the tally of a study: only the first factor has an effect, and the answer names it."""
    raw = {
        "schema_version": 1,
        "title": "t",
        "question": "q",
        "scenario": "a8-strip",
        "design": "latin-hypercube",
        "samples": 40,
        "factor": [
            {"name": "film", "path": "film.irregular_um", "range": [0.0, 5.0]},
            {"name": "kind", "path": "comparator.kind", "levels": ["mono", "stereo"]},
        ],
        "responses": ["strip_plan_at_checks_m"],
        "replicates": 5,
    }
    loaded = build_study(raw, tmp_path)
    tally = Tally.empty(40, 1)
    rng = np.random.default_rng(1)
    for i, cell in enumerate(make_cells(loaded.study)):
        tally.add(i, cell.settings["film.irregular_um"] + 0.1 * rng.standard_normal((1, 5)))
    document = findings_document(loaded, tally)
    (hypercube,) = document["main_effects"]
    assert [each["factor"] for each in hypercube["factors"]] == ["film", "kind"]
    assert "alone it follows film (100 % of the variance between cells" in document["answer"][0]
    assert ", growing with it)" in document["answer"][0]
    assert "kind" not in document["answer"][0].split("alone")[1]
    rows = Page(study_page(document)).table("What each factor weighs alone").rows
    assert [row[0] for row in rows] == ["film", "kind"]
    study_tables(document)
