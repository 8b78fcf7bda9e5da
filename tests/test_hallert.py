"""Hallert's cofactors of the numerical relative orientation, confirmed by simulated observations."""

import tomllib

import numpy as np
import pytest

from a7sim.reduction import ProjectorPose, element_corrections, relative_orientation

B, D, H = 92.0, 92.0, 152.0
SETS = 20_000
SIX_POINTS = np.array([(x, y, -H) for y in (0.0, D, -D) for x in (0.0, B)]).T
DEPENDENT = ("by2", "bz2", "kappa2", "phi2", "omega2")
SWINGS = ("kappa1", "kappa2", "phi1", "phi2", "omega1")
PARALLAX_MM = 0.005
IMAGE_MM = 0.002
CLOSED_COVARIANCES = {
    ("by2", "omega2"): H * (3.0 * H**2 + 2.0 * D**2) / (4.0 * D**4),
    ("by2", "kappa2"): 1.0 / (3.0 * B),
    ("bz2", "phi2"): H**2 / (2.0 * B * D**2),
}


@pytest.fixture(scope="module")
def numbers(reference):
    return tomllib.loads((reference / "09_hallert_cofactors.toml").read_text(encoding="utf-8"))["numeric_b92_d92_h152"]


def spread_by_parallaxes(names):
    """Return the covariance of the corrections from simulated y-parallaxes of weight 1, in units of their variance."""
    parallaxes = PARALLAX_MM * np.random.default_rng(1956).standard_normal((6, SETS))
    one_batch = np.zeros((3, 1))
    left, right = ProjectorPose(one_batch, one_batch), ProjectorPose(np.array([[B], [0.0], [0.0]]), one_batch)
    found = element_corrections(parallaxes, SIX_POINTS[..., None], left, right, names)
    return np.cov(found.unknowns) / PARALLAX_MM**2


def spread_by_coplanarity(names):
    """Return the same from simulated image coordinates of vertical photographs; a y-parallax has the variance of two.

    As a component of the base by2 counts with Y; a by spindle counts against it.
    """
    rng = np.random.default_rng(1956)
    images = [
        SIX_POINTS[:2, :, None] - np.array([[[x]], [[0.0]]]) + IMAGE_MM * rng.standard_normal((2, 6, SETS))
        for x in (0.0, B)
    ]
    found = relative_orientation(*images, H, H, "dependent" if names == DEPENDENT else "independent", 1, bx=B)
    signs = np.array([-1.0 if name == "by2" else 1.0 for name in names])
    return np.outer(signs, signs) * np.cov([found.elements[name] for name in names]) / (2.0 * IMAGE_MM**2)


def propagated(names):
    left, right = ProjectorPose(np.zeros(3), np.zeros(3)), ProjectorPose(np.array([B, 0.0, 0.0]), np.zeros(3))
    return element_corrections(np.zeros(6), SIX_POINTS, left, right, names).cofactors


METHODS = pytest.mark.parametrize("spread", [spread_by_parallaxes, spread_by_coplanarity])


@METHODS
def test_dependent_variances_equal_hallerts_within_three_per_cent(numbers, spread):
    np.testing.assert_allclose(np.diag(spread(DEPENDENT)), numbers["dependent_by_bz_kappa_phi_omega"], rtol=0.03)


@METHODS
def test_swing_swing_variances_equal_hallerts_within_three_per_cent(numbers, spread):
    np.testing.assert_allclose(np.diag(spread(SWINGS)), numbers["swing_k1_k2_f1_f2_w1"], rtol=0.03)


@METHODS
@pytest.mark.parametrize("pair", [("by2", "omega2"), ("bz2", "phi2")])
def test_strong_dependent_covariances_equal_hallerts_within_three_per_cent(spread, pair):
    i, j = (DEPENDENT.index(name) for name in pair)
    assert abs(spread(DEPENDENT)[i, j]) == pytest.approx(CLOSED_COVARIANCES[pair], rel=0.03)


@METHODS
def test_the_correlation_of_swing_and_tilt_equals_hallerts(numbers, spread):
    covariance = spread(SWINGS)
    correlation = covariance[0, 4] / np.sqrt(covariance[0, 0] * covariance[4, 4])
    assert abs(correlation) == pytest.approx(abs(numbers["swing_correlation_k1_w1"]), rel=0.03)


@METHODS
@pytest.mark.parametrize("names", [DEPENDENT, SWINGS])
def test_all_covariances_equal_the_propagated_ones(spread, names):
    """Within 3 % of the product of both standard deviations: a weak correlation such as that of by and kappa (0.14)
    is not known better from 20,000 sets, nor is one that is zero."""
    expected, got = propagated(names), spread(names)
    spreads = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(got / np.outer(spreads, spreads), expected / np.outer(spreads, spreads), atol=0.03)


def test_the_weak_covariance_of_by_and_kappa_equals_hallerts():
    i, j = DEPENDENT.index("by2"), DEPENDENT.index("kappa2")
    assert abs(propagated(DEPENDENT)[i, j]) == pytest.approx(CLOSED_COVARIANCES["by2", "kappa2"], rel=1e-9)
