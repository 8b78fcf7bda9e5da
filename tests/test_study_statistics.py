"""Statistics of studies against independent programs and against their stated coverage."""

import numpy as np
import pytest
from scipy import stats

from a7sim.study.statistics import (
    compare_cells,
    densities,
    holm,
    mean_interval,
    quantile_with_interval,
    regress_on,
    sd_interval,
    variance_by_factor,
)

RNG = np.random.default_rng(12)


def test_a_comparison_is_the_paired_t_test_of_scipy():
    one, other = RNG.normal(1.0, 1.0, 40), RNG.normal(0.8, 1.0, 40)
    expected = stats.ttest_rel(one, other)
    found = compare_cells(one, other)
    assert found.p == pytest.approx(expected.pvalue)
    assert found.interval == pytest.approx(tuple(expected.confidence_interval()))


def test_a_comparison_excludes_pairs_with_a_session_that_gave_up():
    found = compare_cells(np.array([1.0, np.nan, 3.0, 5.0]), np.array([0.0, 1.0, np.nan, 2.0]))
    assert (found.pairs, found.difference) == (2, 2.0)


def test_one_factor_in_blocks_is_the_paired_t_test_squared():
    values = RNG.normal(size=(2, 25)) + RNG.normal(size=25)
    effect, rest = variance_by_factor(values, ["f"])
    expected = stats.ttest_rel(*values)
    assert pytest.approx(expected.statistic**2) == effect.F
    assert effect.p == pytest.approx(expected.pvalue)
    assert (effect.freedom, rest.freedom) == (1, 24)


def test_variance_of_two_factors_equals_that_of_a_least_squares_fit():
    """The sum of squares of every source is the increase of the residual sum without its columns."""
    values = RNG.normal(size=(2, 3, 7)) + np.array([0.0, 1.0])[:, None, None] + np.arange(3.0)[None, :, None]
    i, j, k = (axis.ravel() for axis in np.indices(values.shape))
    columns = {
        ("f",): _contrasts(i, 2),
        ("g",): _contrasts(j, 3),
        ("f", "g"): np.stack([a * b for a in _contrasts(i, 2).T for b in _contrasts(j, 3).T], axis=1),
        "blocks": _contrasts(k, 7),
    }
    everything = _remaining(columns.values(), values.ravel())
    found = {each.source: each for each in variance_by_factor(values, ["f", "g"])}
    assert found[()].squares == pytest.approx(everything)
    for source in (("f",), ("g",), ("f", "g")):
        without = _remaining([each for name, each in columns.items() if name != source], values.ravel())
        assert found[source].squares == pytest.approx(without - everything)
        assert found[source].freedom == columns[source].shape[1]


def _contrasts(level, levels):
    return np.stack([(level == each).astype(float) - (level == levels - 1) for each in range(levels - 1)], axis=1)


def _remaining(columns, values):
    design = np.column_stack([np.ones(len(values)), *columns])
    return float(((values - design @ np.linalg.lstsq(design, values, rcond=None)[0]) ** 2).sum())


def test_the_interval_of_a_quantile_equals_that_of_many_resamples():
    values = RNG.exponential(size=60)
    found, interval = quantile_with_interval(values, 0.5)
    resampled = np.sort(RNG.choice(values, (20_000, 60)), axis=1)[:, 29]
    assert found == np.sort(values)[29]
    for limit, share in zip(interval, (0.025, 0.975), strict=True):
        assert (resampled < limit).mean() <= share + 0.005
        assert (resampled <= limit).mean() >= share - 0.005


def test_intervals_contain_the_truth_at_the_stated_rate():
    held = {"mean": 0, "sd": 0, "median": 0}
    for key in range(100):
        values = RNG.normal(size=50)
        intervals = {
            "mean": (mean_interval(float(values.mean()), float(values.std(ddof=1)), 50), 0.0),
            "sd": (sd_interval(values, 1, (key,)), 1.0),
            "median": (quantile_with_interval(values, 0.5)[1], 0.0),
        }
        for name, ((low, high), truth) in intervals.items():
            held[name] += low <= truth <= high
    assert all(86 <= count <= 100 for count in held.values())


def test_the_bootstrap_is_the_same_for_the_same_seed_and_key():
    values = RNG.normal(size=30)
    assert sd_interval(values, 1, (0, 2)) == sd_interval(values, 1, (0, 2)) != sd_interval(values, 1, (0, 3))


def test_holms_correction_equals_a_hand_computation():
    assert holm([0.01, 0.04, 0.03, float("nan")]) == pytest.approx([0.03, 0.06, 0.06, float("nan")], nan_ok=True)


def test_an_effect_does_not_count_cells_with_common_sessions_twice():
    """The F of a factor is the same when every cell is repeated over a factor without effect."""
    values = RNG.normal(size=(3, 30))
    (alone, *_), (crossed, nothing, both, _) = (
        variance_by_factor(values, ["f"]),
        variance_by_factor(np.stack([values] * 4, axis=1), ["f", "g"]),
    )
    assert pytest.approx(alone.F) == crossed.F
    assert crossed.p == pytest.approx(alone.p)
    assert (nothing.squares, both.squares) == (0.0, 0.0)


def test_the_degrees_of_freedom_of_an_effect_are_reduced_if_its_levels_are_correlated():
    """Greenhouse's and Geisser's epsilon is 1 / freedom if all differences are multiples of one series."""
    base = RNG.normal(size=40)
    one_direction = np.outer([0.0, 1.0, 2.0, 3.0], base) + RNG.normal(size=40)
    effect = variance_by_factor(one_direction, ["f"])[0]
    assert effect.epsilon == pytest.approx(1.0 / 3.0)
    assert effect.p == pytest.approx(stats.ttest_1samp(base, 0.0).pvalue)


@pytest.mark.parametrize("shift", [0.0, 0.6])
def test_the_interval_of_an_effect_contains_the_truth_at_the_stated_rate(shift):
    rng = np.random.default_rng(int(10 * shift))
    held = 0
    for _ in range(300):
        common = rng.normal(0.0, 0.8, 60)
        found = compare_cells(common + rng.normal(shift, 0.6, 60), common + rng.normal(0.0, 0.6, 60))
        low, high = found.effect_interval
        held += low <= shift <= high
    assert 270 <= held <= 297


def test_a_contrast_of_cells_is_that_of_their_means_in_deviations_of_one_replicate():
    values, against = RNG.normal(1.0, 1.0, (3, 2000)), RNG.normal(0.0, 1.0, (2, 2000))
    found = compare_cells(values, against)
    assert found.difference == pytest.approx(values.mean() - against.mean())
    assert found.effect == pytest.approx(1.0, abs=0.1)


def test_dependence_in_one_cell_is_the_regression_of_scipy():
    x = RNG.normal(size=400)
    y = 0.5 * x + RNG.normal(size=400)
    found, expected = regress_on(y[None], x[None]), stats.linregress(x, y)
    assert (found.slope, found.correlation) == pytest.approx((expected.slope, expected.rvalue))
    interval = stats.pearsonr(x, y).confidence_interval()
    assert found.correlation_interval == pytest.approx(tuple(interval), abs=0.03)


def test_dependence_removes_differences_between_cells_and_counts_replicates_once():
    x = RNG.normal(size=(1, 300))
    y = 0.2 * x + RNG.normal(size=(1, 300))
    one, same_twice = regress_on(y, x), regress_on(np.vstack([y, y + 7.0]), np.vstack([x, x - 5.0]))
    assert same_twice.slope == pytest.approx(one.slope)
    assert same_twice.interval == pytest.approx(one.interval)
    assert same_twice.correlation_interval == pytest.approx(one.correlation_interval)


def test_a_density_contains_nearly_all_values_and_constant_values_have_none():
    found = densities({"f": RNG.normal(5.0, 1.0, 3000), "same": np.full(3000, 2.0)})
    assert list(found["densities"]) == ["f"]
    assert np.trapezoid(found["densities"]["f"], found["places"]) == pytest.approx(1.0, abs=0.02)
    assert densities({"same": np.full(10, 2.0)}) == {}


def test_too_few_values_give_nan():
    """One value has no spread, two no regression, none no quantile: the result is NaN."""
    one, two = np.array([2.0]), np.array([[1.0, 2.0]])
    assert np.isnan(mean_interval(2.0, 0.0, 1)).all()
    assert np.isnan(sd_interval(one, 1, (0,))).all()
    value, interval = quantile_with_interval(np.array([]), 0.5)
    assert np.isnan([value, *interval]).all()
    alone = compare_cells(one, np.array([1.0]))
    assert alone.pairs == 1
    assert np.isnan([alone.difference, *alone.interval, alone.p]).all()
    same, rising = np.ones((1, 5)), np.arange(5.0)[None]
    for values, on, count in ((two, two, 2), (same, rising, 5), (rising, same, 5)):
        found = regress_on(values, on)
        assert found.replicates == count
        assert np.isnan([found.slope, *found.interval, found.correlation, *found.correlation_interval, found.p]).all()
    assert variance_by_factor(np.array([[1.0, np.nan], [2.0, 3.0]]), ["f"]) == []
