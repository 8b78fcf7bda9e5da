"""The reductions: published oracles and exact recovery."""

import csv
import re
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from a7sim.reduction import (
    ProjectorPose,
    Undetermined,
    element_corrections,
    perspective_centre,
    picture_placement,
    solve_least_squares,
)

LEVELS = (4900.0, 5100.0)
PLAN_OF_SIX = np.array([(x, y) for x in (0.0, 195.0) for y in (0.0, 170.0, -170.0)]).T


def printed_centres(reference):
    lines = (reference / "11_seed_a7_perspective_centres.csv").read_text(encoding="utf-8").splitlines()
    for row in csv.DictReader(line for line in lines if not line.startswith("#")):
        key = f"{row['model']}{row['case']}-{row['side']}"
        yield key, {name: float(value) for name, value in row.items() if name not in ("model", "case", "side")}


def pointings_towards(centre, noise=0.0, rng=None):
    """Pointings at the two levels along rays that meet in a centre X0, Y0, Z0 (counter units)."""
    rng = rng or np.random.default_rng(0)
    X0, Y0, Z0 = centre
    slopes = PLAN_OF_SIX / (Z0 - 5000.0)
    return tuple(
        np.array([[X0], [Y0]]) + slopes * (Z0 - level) + noise * rng.standard_normal((2, 6)) for level in LEVELS
    )


def test_the_printed_centres_of_the_thesis_are_recovered_from_pointings_that_fit(reference):
    for _, printed in printed_centres(reference):
        found = perspective_centre(*pointings_towards((printed["X0"], printed["Y0"], printed["Z0"])), *LEVELS)
        assert float(found.X0) == pytest.approx(printed["X0"], abs=1e-6)
        assert float(found.Y0) == pytest.approx(printed["Y0"], abs=1e-6)
        assert float(found.Z0) == pytest.approx(printed["Z0"], abs=1e-5)
        assert float(found.T0) == pytest.approx((printed["Z0"] - 4900.0) / 200.0, abs=1e-8)


def test_t0_exposes_the_misprints_of_the_thesis(reference):
    """geometry.md: T0 = (Z0 - 4900) / 200 to the printed digits in 18 of the 20."""
    centres = dict(printed_centres(reference))
    wrong_t0 = {key for key, c in centres.items() if abs(c["T0"] - (c["Z0"] - 4900.0) / 200.0) > 0.00101}
    assert wrong_t0 == {"1C-L", "1D-R"}


def test_sigmas_and_coordinates_expose_the_other_misprints(reference):
    centres = dict(printed_centres(reference))
    wrong_sigma = {key for key, c in centres.items() if abs(c["sZ0"] / 200.0 - c["sT0"]) > 0.00101}
    assert wrong_sigma == {"1D-R", "2A-R", "2C-R"}
    of_side = {side: [c["X0"] for key, c in centres.items() if key.endswith(side)] for side in "LR"}
    assert [key for key, c in centres.items() if abs(c["X0"] - np.median(of_side[key[-1]])) > 2.0] == ["2B-L"]


def test_y0_as_printed_stands_out_of_its_model_where_it_is_misprinted(reference):
    """1C left is printed 4892.412; the centres of a model share their Y but for hundredths of by'."""
    printed = {key: c["Y0"] for key, c in printed_centres(reference)} | {"1C-L": 4892.412}
    of_model = {model: np.median([y for key, y in printed.items() if key[0] == model]) for model in "12"}
    assert [key for key, y in printed.items() if abs(y - of_model[key[0]]) > 1.0] == ["1C-L"]


def test_eight_micrometres_of_pointing_give_the_theses_standard_deviations():
    """geometry.md: sigma X0 0.066, Y0 0.058, Z0 0.88, T0 0.004, rms 0.14; the reduction's own estimates agree."""
    rng = np.random.default_rng(11)
    low, high = (
        np.stack(each, axis=-1)
        for each in zip(*(pointings_towards((5000.0, 4992.0, 7573.0), 0.008, rng) for _ in range(4000)), strict=True)
    )
    found = perspective_centre(low, high, *LEVELS)
    assert found.X0.std() == pytest.approx(0.066, rel=0.06)
    assert found.Y0.std() == pytest.approx(0.058, rel=0.06)
    assert found.Z0.std() == pytest.approx(0.88, rel=0.06)
    assert found.T0.std() == pytest.approx(0.0044, rel=0.06)
    assert np.sqrt((found.rms**2).mean()) == pytest.approx(0.1456, rel=0.03)
    for name in ("X0", "Y0", "Z0", "T0"):
        estimated = np.sqrt((getattr(found, f"sigma_{name}") ** 2).mean())
        assert estimated == pytest.approx(getattr(found, name).std(), rel=0.05)


def test_a_centre_needs_two_points_and_two_levels():
    low, high = pointings_towards((5000.0, 5000.0, 7600.0))
    with pytest.raises(Undetermined):
        perspective_centre(low[:, :1], high[:, :1], *LEVELS)
    with pytest.raises(Undetermined):
        perspective_centre(low, low, *LEVELS)


def _six_points(b, d, h):
    plan = [(0.0, 0.0), (b, 0.0), (0.0, d), (b, d), (0.0, -d), (b, -d)]
    return np.array([(x, y, -h) for x, y in plan]).T


def _projectors(b):
    return ProjectorPose(np.zeros(3), np.zeros(3)), ProjectorPose(np.array([b, 0.0, 0.0]), np.zeros(3))


def _closed_form(text, **values):
    product = re.sub(r"(?<=[0-9a-z)])\s+(?=[a-z(])", "*", text.replace("^", "**"))
    return eval(re.sub(r"(?<=\d)(?=[bdh])", "*", product), {"__builtins__": {}}, values)


def test_cofactors_are_hallerts_closed_forms(reference):
    hallert = tomllib.loads((reference / "09_hallert_cofactors.toml").read_text(encoding="utf-8"))
    b = d = 92.0
    h = 152.0
    left, right = _projectors(b)
    points = _six_points(b, d, h)
    dependent = ("by2", "bz2", "kappa2", "phi2", "omega2")
    found = element_corrections(np.zeros(6), points, left, right, dependent)
    np.testing.assert_allclose(
        np.diag(found.cofactors), hallert["numeric_b92_d92_h152"]["dependent_by_bz_kappa_phi_omega"], rtol=1e-9
    )
    for name in ("by", "bz", "kappa", "phi", "omega"):
        i = dependent.index(f"{name}2")
        assert found.cofactors[i, i] == pytest.approx(
            _closed_form(hallert["dependent"][f"Q_{name}"], b=b, d=d, h=h), rel=1e-9
        )
    for pair in (("by", "omega"), ("by", "kappa"), ("bz", "phi")):
        i, j = (dependent.index(f"{name}2") for name in pair)
        closed = _closed_form(hallert["dependent"][f"abs_Q_{'_'.join(pair)}"], b=b, d=d, h=h)
        assert abs(found.cofactors[i, j]) == pytest.approx(closed, rel=1e-9)
    swing = element_corrections(
        np.zeros(6), points, left, right, ("kappa1", "kappa2", "phi1", "phi2", "omega1")
    ).cofactors
    for i, name in enumerate(("kappa1", "kappa1", "phi1", "phi2", "omega1")):
        assert swing[i, i] == pytest.approx(_closed_form(hallert["swing_swing"][f"Q_{name}"], b=b, d=d, h=h), rel=1e-9)
    correlation = swing[0, 4] / np.sqrt(swing[0, 0] * swing[4, 4])
    assert correlation == pytest.approx(hallert["numeric_b92_d92_h152"]["swing_correlation_k1_w1"], abs=5e-4)


def test_points_on_a_line_do_not_orient():
    left, right = _projectors(195.0)
    on_a_line = np.array([(x, 0.0, -325.0) for x in np.linspace(0.0, 195.0, 9)]).T
    with pytest.raises(Undetermined):
        element_corrections(np.zeros(9), on_a_line, left, right, ("kappa1", "kappa2", "phi1", "phi2", "omega1"))


def test_four_points_do_not_orient():
    left, right = _projectors(195.0)
    with pytest.raises(Undetermined):
        element_corrections(
            np.zeros(4),
            _six_points(195.0, 180.0, 325.0)[:, 2:],
            left,
            right,
            ("kappa1", "kappa2", "phi1", "phi2", "omega1"),
        )


@given(st.integers(0, 10_000))
def test_least_squares_equals_numpy_and_a_batch_equals_its_members(seed):
    rng = np.random.default_rng(seed)
    design, observed = rng.standard_normal((9, 4, 3)), rng.standard_normal((9, 3))
    together = solve_least_squares(design, observed)
    for i in range(3):
        expected, squares, *_ = np.linalg.lstsq(design[:, :, i], observed[:, i], rcond=None)
        np.testing.assert_allclose(together.unknowns[:, i], expected, rtol=1e-7, atol=1e-9)
        assert together.s0[i] == pytest.approx(np.sqrt(squares[0] / 5.0), rel=1e-7)
        one = solve_least_squares(design[:, :, i], observed[:, i])
        np.testing.assert_allclose(together.sigmas[:, i], one.sigmas, rtol=1e-9)
        np.testing.assert_allclose(together.condition[i], one.condition, rtol=1e-6)
    np.testing.assert_allclose(together.redundancy_numbers.sum(axis=0), 5.0)
    np.testing.assert_allclose(np.einsum("ii...->i...", together.correlations), 1.0)


def test_weights_count_as_repeated_observations():
    rng = np.random.default_rng(2)
    design, observed = rng.standard_normal((7, 3)), rng.standard_normal(7)
    weighted = solve_least_squares(design, observed, weights=np.array([1.0, 2.0, 1.0, 3.0, 1.0, 1.0, 1.0]))
    rows = [0, 1, 1, 2, 3, 3, 3, 4, 5, 6]
    repeated = solve_least_squares(design[rows], observed[rows], redundancy=4)
    np.testing.assert_allclose(weighted.unknowns, repeated.unknowns)
    np.testing.assert_allclose(weighted.sigmas, repeated.sigmas)
    assert weighted.redundancy_numbers.sum() == pytest.approx(4.0)


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-1e-3, 1e-3), st.floats(-1e-3, 1e-3))
def test_the_placement_of_a_picture_is_recovered_from_its_fiducials(dx, dy, turn, scale):
    marks = np.array([(-106.0, -106.0), (106.0, 106.0), (-106.0, 106.0), (106.0, -106.0)]).T
    x, y = marks
    displaced = np.array([dx - turn * y + scale * x, dy + turn * x + scale * y])
    lie = picture_placement(displaced, marks)
    np.testing.assert_allclose((lie.dx, lie.dy, lie.turn, lie.scale), (dx, dy, turn, scale), atol=1e-12)
