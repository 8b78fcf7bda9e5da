"""Similarity, strips, absolute orientation, polynomials and blocks: published oracles and exact recovery."""

import subprocess
import sys
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares

from a7sim.errors import A7SimError
from a7sim.geometry import image_of, ray_of, rotation, stereoscopic_intersection
from a7sim.reduction.absolute import Ground, absolute_orientation, max_abs_residual, root_mean_square
from a7sim.reduction.block import block_adjustment
from a7sim.reduction.coplanarity import relative_orientation
from a7sim.reduction.least_squares import Undetermined
from a7sim.reduction.polynomials import StripAxis, strip_adjustment, strip_axis
from a7sim.reduction.similarity import similarity_by_iteration, similarity_by_quaternion
from a7sim.reduction.strips import Model, formed_strip, in_order, is_centre
from tests.support.hypothesis_profile import examples

SEEDS = st.integers(0, 2**32 - 1)


def load(reference, name):
    return tomllib.loads((reference / name).read_text(encoding="utf-8"))


def any_rotation(rng, *shape):
    q = rng.standard_normal((4, *shape))
    d, a, b, c = q / np.sqrt((q * q).sum(axis=0))
    return np.array(
        [
            [d * d + a * a - b * b - c * c, 2 * (a * b - c * d), 2 * (a * c + b * d)],
            [2 * (a * b + c * d), d * d - a * a + b * b - c * c, 2 * (b * c - a * d)],
            [2 * (a * c - b * d), 2 * (b * c + a * d), d * d - a * a - b * b + c * c],
        ]
    )


# --- similarity ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("solved", [similarity_by_iteration, similarity_by_quaternion])
def test_similarity_is_dewitts_with_its_standard_deviations(reference, solved):
    case = load(reference, "03_dewitt_public_domain.toml")["similarity"]
    points, targets = (np.array([[row[k] for row in case["common"]] for k in axes]) for axes in ("xyz", "XYZ"))
    found = solved(points, targets)
    assert float(found.scale) == pytest.approx(case["expected_scale"], abs=5e-6)
    np.testing.assert_allclose(np.degrees(found.angles), case["expected_omega_phi_kappa_deg"], atol=5.1e-5)
    np.testing.assert_allclose(found.translation, case["expected_T"], atol=5.1e-4)
    sd = case["expected_sd"]
    assert float(found.sigma_scale) == pytest.approx(sd["scale"], abs=5e-6)
    np.testing.assert_allclose(np.degrees(found.sigma_angles), [sd["omega"], sd["phi"], sd["kappa"]], atol=5.1e-5)
    np.testing.assert_allclose(found.sigma_translation, [sd["Tx"], sd["Ty"], sd["Tz"]], atol=5.1e-4)
    assert float(found.s0) == pytest.approx(case["expected_s0"], abs=5e-6)
    others, expected = (np.array([[row[k] for row in case["transformed"]] for k in axes]) for axes in ("xyz", "XYZ"))
    np.testing.assert_allclose(found.applied_to(others), expected, atol=5.1e-4)
    assert found.adjustment.redundancy == 11
    assert found.adjustment.redundancy_numbers.sum() == pytest.approx(11.0)


@given(SEEDS)
def test_any_similarity_is_recovered_in_both_directions(seed):
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((3, int(rng.integers(3, 9)))) * 100.0
    turn, scale, shift = any_rotation(rng), 10.0 ** rng.uniform(-3, 3), rng.standard_normal(3) * 1000.0
    targets = scale * turn @ points + shift[:, None]
    for solved in (similarity_by_iteration, similarity_by_quaternion):
        found = solved(points, targets)
        assert float(found.scale) == pytest.approx(scale, rel=1e-9)
        np.testing.assert_allclose(found.rotation, turn, atol=1e-9)
        np.testing.assert_allclose(found.applied_to(points), targets, atol=1e-9 * (1000.0 + 100.0 * scale))
        np.testing.assert_allclose(found.inverted(targets), points, atol=1e-9 * (100.0 + 1000.0 / scale))


@given(SEEDS)
def test_iteration_and_quaternion_agree_where_points_do_not_fit(seed):
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((3, 6, 5))
    targets = 2.0 * np.einsum("ijm,jnm->inm", any_rotation(rng, 5), points) + 0.1 * rng.standard_normal((3, 6, 5))
    iterated, closed = similarity_by_iteration(points, targets), similarity_by_quaternion(points, targets)
    np.testing.assert_allclose(iterated.rotation, closed.rotation, atol=1e-9)
    np.testing.assert_allclose(iterated.scale, closed.scale, rtol=1e-9)
    np.testing.assert_allclose(iterated.translation, closed.translation, atol=1e-9)
    np.testing.assert_allclose(iterated.adjustment.sigmas, closed.adjustment.sigmas, rtol=1e-6)


@given(SEEDS)
def test_a_batch_of_similarities_equals_its_members_in_any_order_of_points(seed):
    rng = np.random.default_rng(seed)
    points, targets = rng.standard_normal((2, 3, 5, 4))
    weights = rng.uniform(0.5, 2.0, 5)
    order = rng.permutation(5)
    together = similarity_by_quaternion(points, targets, weights)
    for i in range(4):
        one = similarity_by_quaternion(points[:, order, i], targets[:, order, i], weights[order])
        np.testing.assert_allclose(together.rotation[..., i], one.rotation, atol=1e-8)
        np.testing.assert_allclose(together.scale[i], one.scale, rtol=1e-8, atol=1e-10)
        np.testing.assert_allclose(together.translation[:, i], one.translation, atol=1e-8)


@pytest.mark.parametrize("solved", [similarity_by_iteration, similarity_by_quaternion])
def test_s0_is_that_of_the_weighted_residuals_computed_minus_given(solved):
    rng = np.random.default_rng(6)
    points, targets = rng.standard_normal((3, 8)), rng.standard_normal((3, 8))
    weights = rng.uniform(0.5, 2.0, 8)
    found = solved(points, targets, weights if solved is similarity_by_quaternion else np.tile(weights, (3, 1)))
    residuals = found.scale * found.rotation @ points + found.translation[:, None] - targets
    np.testing.assert_allclose(found.adjustment.residuals, residuals.reshape(-1), atol=1e-9)
    assert found.s0 == pytest.approx(np.sqrt((weights * residuals**2).sum() / (3 * 8 - 7)), rel=1e-9)


def test_a_model_upside_down_is_rotated():
    points = np.array([[0, 0, -1], [1, 0, 0], [0, 2, 0], [3, 3, 1.0]]).T
    targets = np.diag([1.0, -1.0, -1.0]) @ points
    np.testing.assert_allclose(similarity_by_iteration(points, targets).rotation, np.diag([1, -1, -1]), atol=1e-9)


@pytest.mark.parametrize("solved", [similarity_by_iteration, similarity_by_quaternion])
def test_two_points_or_points_in_a_line_determine_no_similarity(solved):
    line = np.array([[0, 0, 0], [1, 2, 3], [2, 4, 6.0], [3, 6, 9]]).T
    for points in (line, line[:, :2], line[:, :1], np.zeros((3, 4))):
        with pytest.raises(Undetermined):
            solved(points, 2.0 * points + 5.0)
    with pytest.raises(Undetermined):
        solved(np.stack([line, line], axis=-1), np.stack([line, line], axis=-1))
    with pytest.raises(Undetermined, match="apart from each other"):
        solved(np.zeros((3, 4)), line)


def test_one_point_of_each_member_is_transformed_as_among_others():
    rng = np.random.default_rng(9)
    points, targets = rng.standard_normal((2, 3, 5, 4))
    for found, one in (
        (similarity_by_quaternion(points, targets), points[:, 2]),
        (similarity_by_quaternion(points[..., 0], targets[..., 0]), points[:, 2, 0]),
    ):
        np.testing.assert_allclose(found.applied_to(one), found.applied_to(found.points)[:, 2], atol=1e-12)


@pytest.mark.parametrize("solved", [similarity_by_iteration, similarity_by_quaternion])
def test_one_set_of_points_is_fitted_to_each_of_many_and_many_to_one(solved):
    rng = np.random.default_rng(10)
    one = rng.standard_normal((3, 5))
    many = np.einsum("ijm,jn->inm", any_rotation(rng, 2), one) + 0.1 * rng.standard_normal((3, 5, 2))
    for points, targets in ((one, many), (many, one)):
        together = solved(points, targets)
        for i in range(2):
            alone = solved(*(each[..., i] if each.ndim == 3 else each for each in (points, targets)))
            np.testing.assert_allclose(together.rotation[..., i], alone.rotation, atol=1e-8)
            np.testing.assert_allclose(together.scale[i], alone.scale, rtol=1e-8)


def test_an_iteration_that_does_not_converge_is_reported():
    rng = np.random.default_rng(10)
    points, targets = rng.standard_normal((3, 5)), rng.standard_normal((3, 5, 2))
    with pytest.raises(Undetermined, match="the similarity of 5 points does not converge in 100 iterations"):
        similarity_by_iteration(points, targets)


def test_the_iteration_ends_at_the_best_attitude_wherever_it_starts():
    """Half a turn from the best attitude the normal equations are stationary, and the iteration must not stop there."""
    points = np.array([[3.0, 0, 0], [-3, 0, 0], [0, 2, 0], [0, -2, 0], [0, 0, 1], [0, 0, -1]]).T
    turn = rotation(0.3, -0.2, 1.1)
    half_turns = [np.diag(signs) for signs in ((1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0))]
    for start in [np.eye(3), turn, *(turn @ half for half in half_turns)]:
        found = similarity_by_iteration(points, 2.0 * turn @ points, start=start)
        np.testing.assert_allclose(found.rotation, turn, atol=1e-9)
    both = np.stack([points, points], axis=-1)
    found = similarity_by_iteration(both, 2.0 * np.einsum("ij,jnm->inm", turn, both), start=turn @ half_turns[0])
    np.testing.assert_allclose(found.rotation, np.stack([turn, turn], axis=-1), atol=1e-9)


# --- real strips --------------------------------------------------------------------------------------------------


def sampson(a, b, c, bx):
    """Dependent orientation by an independent program: scipy on coplanarity over its gradient by the image points."""

    def misclosures(u):
        turn, base = rotation(*u[2:]), np.array([bx, u[0], u[1]])[:, None]
        left, right = ray_of(a, np.eye(3), c), ray_of(b, turn, c)
        by_left, by_right = np.cross(right, base, axis=0), turn.T @ np.cross(base, left, axis=0)
        determinant = (base * np.cross(left, right, axis=0)).sum(axis=0)
        return determinant / np.sqrt((by_left[:2] ** 2).sum(axis=0) + (by_right[:2] ** 2).sum(axis=0))

    tight = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    u = least_squares(misclosures, np.zeros(5), x_scale=[1.0, 1.0, 0.01, 0.01, 0.01], **tight).x
    return rotation(*u[2:]), np.array([bx, u[0], u[1]])


def coplanar(a, b, c, bx):
    found = relative_orientation(a, b, c, c, unknowns="dependent", bx=bx)
    return rotation(*found.angles2), found.centre2


def modelled(left, right, photos, c, oriented):
    """A model from two photographs' image points, its base the mean x-parallax."""
    names = [name for name in left if name in right]
    a, b = (np.array([images[name] for name in names]).T for images in (left, right))
    turn, base = oriented(a, b, c, (a[0] - b[0]).mean())
    origin = np.zeros((3, 1))
    points, _ = stereoscopic_intersection(origin, ray_of(a, np.eye(3), c), base[:, None], ray_of(b, turn, c))
    return Model(
        "-".join(photos),
        (*(f"{photo}:centre" for photo in photos), *names),
        np.concatenate([origin, base[:, None], points], axis=1),
    )


def wuhan(reference, oriented):
    case = load(reference, "05_wuhan_two_strips.toml")
    images = {}
    for row in case["data"]["image"]:
        at = np.array([row["x"], row["y"]]) - case["x0_y0_mm"]
        images.setdefault(row["strip"], {}).setdefault(str(row["photo"]), {})[str(row["id"])] = at
    control = case["data"]["control"]
    ground = Ground(
        tuple(str(row["id"]) for row in control),
        np.array([[row[k] for row in control] for k in "ENH"]),
        ("control",) * len(control),
    )
    strips = {
        strip: [
            modelled(by_photo[a], by_photo[b], (a, b), case["c_mm"], oriented)
            for a, b in zip(list(by_photo), list(by_photo)[1:], strict=False)
        ]
        for strip, by_photo in images.items()
    }
    return case["expected"], strips, ground


@pytest.mark.parametrize(("oriented", "digits"), [(sampson, 6e-10), (coplanar, 2e-7)])
def test_two_real_strips_are_oriented_with_the_residuals_listed(reference, oriented, digits):
    expected, strips, ground = wuhan(reference, oriented)
    for number, models in strips.items():
        strip = formed_strip(models)
        assert float(strip.joins[0].scale) == pytest.approx(expected["join_scale"][f"strip{number}"], abs=5.1e-6)
        found = absolute_orientation(strip, ground)
        scale = float(found.similarity.scale)
        assert scale == pytest.approx(expected[f"strip{number}_absolute_scale"], rel=digits)
        listed = np.array(expected[f"strip{number}_control_max_residual_m"])
        assert (max_abs_residual(found.fit.at_control) < listed + 5.1e-4).all()
        assert all(text.startswith("ground points that the model has not") for text in found.warnings)


def test_north_given_for_east_gives_a_warning(reference):
    _, strips, ground = wuhan(reference, coplanar)
    swapped = Ground(ground.points, ground.coordinates[[1, 0, 2]], ground.roles)
    for models in strips.values():
        warnings = absolute_orientation(formed_strip(models), swapped).warnings
        assert any("left-handed" in text and "swap" in text for text in warnings)


def test_the_calgary_pair_fits_its_check_points_from_the_published_orientation(reference):
    case = load(reference, "02_calgary_lab_pair_27_28.toml")
    by, bz, *angles = case["relative_b"]["expected"]
    rows, base = case["absolute"]["points"], np.array([case["bx_mm"], by, bz])
    left, right = (np.array([[row[k] for row in rows] for k in axes]) for axes in (("xl", "yl"), ("xr", "yr")))
    rays = ray_of(left, np.eye(3), case["c_mm"]), ray_of(right, rotation(*angles), case["c_mm"])
    points, _ = stereoscopic_intersection(np.zeros((3, 1)), rays[0], base[:, None], rays[1])
    names = tuple(str(row["id"]) for row in rows)
    ground = Ground(names, np.array([[row[k] for row in rows] for k in "XYZ"]), tuple(row["role"] for row in rows))
    found = absolute_orientation(Model("27-28", names, points), ground)
    assert float(found.similarity.scale) == pytest.approx(4.980847707, abs=6e-10)
    np.testing.assert_allclose(root_mean_square(found.fit.at_checks), [0.054, 0.052, 0.154], atol=5.1e-4)
    assert found.warnings == ()
    swapped = Ground(names, ground.coordinates[[1, 0, 2]], ground.roles)
    assert any("left-handed" in text for text in absolute_orientation(Model("27-28", names, points), swapped).warnings)


# --- theoretical strips -------------------------------------------------------------------------------------------


def flight(rng, photographs=11, base=3000.0, height=6000.0, relief=200.0):
    """Ground points by name, standard points below the photographs of a straight flight, and their centres."""
    points = {
        f"{photo}{row}": np.array([photo * base, side * base, 0.0]) + rng.uniform(-0.1, 0.1, 3) * (base, base, relief)
        for photo in range(photographs)
        for row, side in (("a", 1.0), ("b", 0.0), ("c", -1.0))
    }
    centres = {f"{photo}:centre": np.array([photo * base, 0.0, height]) for photo in range(photographs)}
    return points, centres


def perfect_models(rng, points, centres, independent=True):
    """Models of neighbouring photographs, each in a system of its own, without errors."""
    photographs, models = len(centres), []
    for i in range(photographs - 1):
        ends = [f"{i}:centre", f"{i + 1}:centre"]
        names = ends + [name for name in points if int(name[:-1]) in (i, i + 1)]
        places = {**points, **centres}
        true = np.array([places[name] for name in names]).T
        if independent:
            turn = rotation(*(rng.standard_normal(3) * (0.1, 0.1, 2.0)))
            local = turn.T @ (true - true[:, :1]) / rng.uniform(2000.0, 5000.0) + rng.uniform(-50, 50, (3, 1))
        else:
            local = (true - true[:, :1]) / rng.uniform(2000.0, 5000.0)
        models.append(Model(f"{i}-{i + 1}", tuple(names), local))
    return models


def grounded(points, role_of):
    names = tuple(points)
    return Ground(names, np.array([points[name] for name in names]).T, tuple(role_of(name) for name in names))


def schuts_role(name):
    """Two points with plan, three with heights (S)."""
    return {"0a": "control", "10c": "control", "5a": "height"}.get(name, "check")


def test_schuts_theoretical_strip_returns_its_ground_coordinates_to_a_millimetre():
    """Eleven exactly vertical photographs, bases of 3 km; perfect images, oriented and intersected (S)."""
    rng, c = np.random.default_rng(1956), 152.0
    points, centres = flight(rng)
    models = []
    for i in range(10):
        names = [name for name in points if int(name[:-1]) in (i, i + 1)]
        true = np.array([points[name] for name in names]).T
        a, b = (image_of(true, centres[f"{k}:centre"][:, None], np.eye(3), c) for k in (i, i + 1))
        turn, base = coplanar(a, b, c, 75.0)
        local, _ = stereoscopic_intersection(
            np.zeros((3, 1)), ray_of(a, np.eye(3), c), base[:, None], ray_of(b, turn, c)
        )
        all_names = (f"{i}:centre", f"{i + 1}:centre", *names)
        models.append(Model(f"{i}", all_names, np.concatenate([np.zeros((3, 1)), base[:, None], local], axis=1)))
    ground = grounded(points, schuts_role)
    for method in ("points", "centre", "heights"):
        found = absolute_orientation(formed_strip(models, method), ground)
        assert found.similarity.adjustment.redundancy == 0
        assert np.nanmax(np.abs(found.fit.residuals)) < 1e-3
        assert found.warnings == ()


@examples(30)
@given(SEEDS)
def test_any_strip_without_errors_is_recovered_in_any_order(seed):
    rng = np.random.default_rng(seed)
    points, centres = flight(rng, photographs=int(rng.integers(2, 8)))
    last = len(centres) - 1
    models = perfect_models(rng, points, centres)
    shuffled = []
    for i in rng.permutation(len(models)):
        order = rng.permutation(len(models[i].points))
        names = tuple(models[i].points[k] for k in order)
        shuffled.append(Model(models[i].name, names, models[i].coordinates[:, order]))
    roles = {"1a": "height", "0a": "control", "0c": "height", f"{last}a": "plan", f"{last}c": "height"}
    ground = grounded(points, lambda name: roles.get(name, "check"))
    size = 3000.0 * len(centres)
    for each in (models, shuffled, models[::-1]):
        strip = formed_strip(each, "points")
        assert all(float(join.max_residual) < 1e-9 * 100.0 for join in strip.joins)
        found = absolute_orientation(strip, ground)
        assert np.nanmax(np.abs(found.fit.residuals)) < 1e-9 * size


def test_methods_of_joining_agree_without_errors_and_a_batch_equals_its_members():
    rng = np.random.default_rng(5)
    points, centres = flight(rng, photographs=5)
    models = perfect_models(rng, points, centres)
    noisy = [
        Model(m.name, m.points, m.coordinates[:, :, None] + 1e-3 * rng.standard_normal((*m.coordinates.shape, 3)))
        for m in models
    ]
    ground = grounded(points, lambda name: "check" if name.endswith("b") else "control")
    for method in ("points", "centre", "heights"):
        exact = absolute_orientation(formed_strip(models, method), ground)
        assert np.nanmax(np.abs(exact.fit.residuals)) < 1e-5
        together = absolute_orientation(formed_strip(noisy, method), ground)
        for i in range(3):
            member = [Model(m.name, m.points, m.coordinates[:, :, i]) for m in noisy]
            one = absolute_orientation(formed_strip(member, method), ground)
            np.testing.assert_allclose(together.fit.residuals[:, :, i], one.fit.residuals, atol=1e-6)


def test_tie_points_are_averaged_and_deviations_come_in_pairs():
    rng = np.random.default_rng(8)
    points, centres = flight(rng, photographs=3)
    models = [
        Model(m.name, m.points, m.coordinates + 1e-3 * rng.standard_normal(m.coordinates.shape))
        for m in perfect_models(rng, points, centres)
    ]
    strip = formed_strip(models)
    first, second = (strip.deviations(model) for model in strip.models)
    for name in strip.joins[0].points:
        a, b = (model.points.index(name) for model in strip.models)
        np.testing.assert_allclose(first[:, a], -second[:, b], atol=1e-12)
        difference = strip.joins[0].differences[:, strip.joins[0].points.index(name)]
        np.testing.assert_allclose(second[:, b], difference / 2.0, atol=1e-12)


def test_models_that_form_no_strip_are_rejected():
    rng = np.random.default_rng(3)
    points, centres = flight(rng, photographs=5)
    models = perfect_models(rng, points, centres)
    assert [model.name for model in in_order([models[2], models[0], models[1]])] == ["2-3", "1-2", "0-1"]
    with pytest.raises(A7SimError, match="in common"):
        formed_strip([models[0], models[1], models[3]])
    with pytest.raises(A7SimError, match="every model once, got model 0-1 twice"):
        formed_strip([models[0], models[0]])
    few = Model("few", ("1:centre", "1a", "9z"), rng.standard_normal((3, 3)))
    with pytest.raises(A7SimError, match="at least 3 common points"):
        formed_strip([models[0], few])
    with pytest.raises(A7SimError, match="got none"):
        formed_strip([])
    with pytest.raises(A7SimError, match="twice"):
        Model("m", ("1", "1"), np.zeros((3, 2)))
    with pytest.raises(ValueError, match="coordinates of 2 points, got 3"):
        Model("m", ("1", "2"), np.zeros((3, 3)))


def having(name, *centres):
    return Model(name, centres, np.zeros((3, len(centres))))


@pytest.mark.parametrize(
    ("models", "sentence"),
    [
        (
            [having("m", "1:centre"), having("n", "1:centre"), having("o", "1:centre")],
            "centre 1:centre: expected at most two models of a strip to share it, got m, n, o",
        ),
        (
            [
                having("m", "1:centre", "2:centre"),
                having("n", "2:centre", "3:centre"),
                having("o", "3:centre", "1:centre"),
            ],
            "expected a strip with two ends, got models in a ring",
        ),
    ],
    ids=["a branch", "a ring"],
)
def test_a_branch_or_a_ring_is_no_strip(models, sentence):
    with pytest.raises(A7SimError) as raised:
        in_order(models)
    assert str(raised.value) == sentence


def test_models_joined_at_a_centre_have_one_in_common_and_points_below_it():
    rng = np.random.default_rng(3)
    points, centres = flight(rng, photographs=3)
    first, second = perfect_models(rng, points, centres)
    for method in ("centre", "heights"):
        ground_alone = first.without("1:centre")
        with pytest.raises(A7SimError, match=r"one common projection centre \(<photo>:centre\), got none"):
            formed_strip([ground_alone, second], method)
    places = np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, -50], [5, -10, -40]]).T
    names = ("1:centre", "1a", "1b", "1c")
    level = [
        Model("m", ("0:centre", *names), np.hstack([[[-90.0], [0], [0]], places])),
        Model("n", names, 2.0 * places),
    ]
    assert float(formed_strip(level, "centre").joins[0].scale) == pytest.approx(0.5)
    with pytest.raises(Undetermined, match="points below the centre, got one at its height"):
        formed_strip(level, "heights")


# --- absolute orientation -----------------------------------------------------------------------------------------


def tilted_model(rng, points):
    names = tuple(points)
    true = np.array([points[name] for name in names]).T
    turn = rotation(0.05, -0.04, 2.0)
    local = turn.T @ (true - true.mean(axis=1, keepdims=True)) / 4000.0
    return Model("m", names, local)


def test_too_little_control_and_control_in_a_line_are_rejected():
    rng = np.random.default_rng(4)
    points, _ = flight(rng, photographs=4)
    model = tilted_model(rng, points)
    for roles in ({"0a": "plan", "3a": "plan"}, {"0a": "control", "3c": "height", "2a": "height"}):
        with pytest.raises(Undetermined, match="expected at least"):
            absolute_orientation(model, grounded(points, lambda name, roles=roles: roles.get(name, "check")))
    line = {name: np.array([int(name[:-1]) * 100.0, 7.0, 3.0]) for name in points if name.endswith("b")}
    with pytest.raises(Undetermined):
        absolute_orientation(tilted_model(rng, line), grounded(line, lambda name: "control"))


def test_control_nearly_in_a_line_gives_a_warning():
    rng = np.random.default_rng(4)
    points, _ = flight(rng, photographs=6, relief=50.0)
    points = {name: place * (1.0, 0.02, 1.0) for name, place in points.items()}
    found = absolute_orientation(tilted_model(rng, points), grounded(points, lambda name: "control"))
    assert any("nearly in a line" in text for text in found.warnings)
    assert not any("left-handed" in text for text in found.warnings)


@pytest.mark.parametrize("partial", [False, True])
def test_left_handed_axes_give_a_warning_with_and_without_centres(partial):
    rng = np.random.default_rng(7)
    points, centres = flight(rng, photographs=4)
    roles = {"0a": "control", "3c": "plan", "3a": "height", "1c": "height"}
    ground = grounded(points, (lambda name: roles.get(name, "check")) if partial else (lambda name: "control"))
    swapped = Ground(ground.points, ground.coordinates[[1, 0, 2]], ground.roles)
    for model in (tilted_model(rng, points), tilted_model(rng, {**points, **centres})):
        assert absolute_orientation(model, ground).warnings == ()
        assert any("left-handed" in text for text in absolute_orientation(model, swapped).warnings)


def test_three_points_of_control_detect_left_handed_axes_by_the_model_upside_down():
    """A triangle and its mirror image fit alike: only the vertical direction distinguishes them."""
    points = {"1": [0.0, 0.0, 100.0], "2": [3000.0, 0.0, 120.0], "3": [0.0, 2000.0, 90.0]}
    points = {name: np.array(place) for name, place in points.items()}
    model, ground = tilted_model(np.random.default_rng(1), points), grounded(points, lambda name: "control")
    assert absolute_orientation(model, ground).warnings == ()
    swapped = absolute_orientation(model, Ground(ground.points, ground.coordinates[[1, 0, 2]], ground.roles))
    assert np.abs(swapped.fit.residuals).max() < 1e-6
    (warning,) = swapped.warnings
    assert "the model comes out upside down, its heights inverted" in warning


def test_full_control_points_give_the_attitude_for_partial_ones():
    """The iteration also converges for a model on its side with three full points, heights and plan points."""
    rng = np.random.default_rng(12)
    points, _ = flight(rng, photographs=4)
    model = tilted_model(rng, points)
    on_its_side = Model(model.name, model.points, rotation(1.4, 0.3, 0.2) @ model.coordinates)
    roles = {"0a": "control", "1c": "control", "3a": "control", "2c": "height", "0c": "plan"}
    found = absolute_orientation(on_its_side, grounded(points, lambda name: roles.get(name, "check")))
    assert np.nanmax(np.abs(found.fit.residuals)) < 1e-6


def test_one_model_of_a_batch_gives_the_same_warning_as_alone():
    rng = np.random.default_rng(7)
    points, _ = flight(rng, photographs=4)
    ground = grounded(points, lambda name: "control")
    sound = tilted_model(rng, points)
    assert absolute_orientation(sound, ground).warnings == ()
    for odd in (sound.coordinates[[1, 0, 2]], sound.coordinates * np.array([1.0, 0.02, 1.0])[:, None]):
        alone = absolute_orientation(Model("m", sound.points, odd), ground).warnings
        both = Model("m", sound.points, np.stack([sound.coordinates, odd, 2.0 * sound.coordinates], axis=-1))
        assert alone
        assert absolute_orientation(both, ground).warnings == alone


def test_the_largest_residual_ignores_missing_residuals():
    residuals = np.array([[1.0, np.nan, -3.0], [np.nan, np.nan, np.nan], [0.5, 0.25, 0.0]])
    np.testing.assert_array_equal(max_abs_residual(residuals), [3.0, np.nan, 0.5])


def test_ground_points_missing_in_the_model_are_named_and_wrong_roles_are_rejected():
    rng = np.random.default_rng(7)
    points, _ = flight(rng, photographs=3)
    more = {**points, "77z": np.zeros(3)}
    warnings = absolute_orientation(tilted_model(rng, points), grounded(more, lambda name: "control")).warnings
    assert warnings == ("ground points that the model has not: 77z",)
    with pytest.raises(A7SimError, match="role"):
        Ground(("1",), np.zeros((3, 1)), ("guess",))
    with pytest.raises(A7SimError, match="ground point 1: expected every point once, got it twice"):
        Ground(("1", "1"), np.zeros((3, 2)), ("control", "check"))
    with pytest.raises(ValueError, match="as many names, coordinates and roles, got 1, 2, 1"):
        Ground(("1",), np.zeros((3, 2)), ("control",))
    with pytest.raises(A7SimError, match="gap"):
        Ground(("1",), np.array([[np.nan], [0.0], [0.0]]), ("plan",))


# --- polynomials --------------------------------------------------------------------------------------------------


@examples(50)
@given(SEEDS, st.sampled_from([2, 3]), st.booleans())
def test_any_polynomial_deformation_is_recovered(seed, degree, batch):
    rng = np.random.default_rng(seed)
    shape = (2,) if batch else ()
    x, y = np.meshgrid(np.linspace(0.0, 40_000.0, 9), [-2500.0, 0.0, 2500.0])
    plan = (x.ravel() + 1j * y.ravel()) * np.exp(1j * rng.uniform(0, 6)) + 5e5
    coordinates = np.array([plan.real, plan.imag, rng.uniform(0, 300, plan.size)])
    coordinates = np.broadcast_to(coordinates.reshape((3, -1, *(1,) * len(shape))), (3, plan.size, *shape))
    names = tuple(str(i) for i in range(plan.size))
    axis = strip_axis(Model("strip", names, coordinates))
    plan_terms, height_terms = (10.0 * rng.standard_normal((n, *shape)) for n in (2 * degree + 2, 2 * degree + 1))
    z = axis.plan(coordinates)
    along, across = axis.along
    a = plan_terms[0::2] + 1j * plan_terms[1::2]
    shift = sum(term * z**power for power, term in enumerate(a))
    east, north = shift.real * along - shift.imag * across, shift.real * across + shift.imag * along
    u, v = z.real, z.imag
    powers = [1.0 + 0.0 * u, u, v, u * u, u * v, u**3, u * u * v][: len(height_terms)]
    rise = sum(term * power for term, power in zip(height_terms, powers, strict=True))
    true = coordinates + np.array([east, north, rise])
    roles = tuple("control" if i % 9 in (0, 3, 5, 8) else "check" for i in range(plan.size))
    order = rng.permutation(plan.size)
    for i in range(2 if batch else 1):
        one = true[..., i] if batch else true
        ground = Ground(tuple(names[k] for k in order), one[:, order], tuple(roles[k] for k in order))
        found = strip_adjustment(Model("strip", names, coordinates), ground, degree)
        away = found.fit.residuals[..., i] if batch else found.fit.residuals
        assert np.abs(away).max() < 1e-9 * 5e5
        terms = found.plan.unknowns[:, i] if batch else found.plan.unknowns
        np.testing.assert_allclose(terms, plan_terms[:, i] if batch else plan_terms, atol=1e-6)


def test_bow_twist_and_drift_are_named_with_the_strips_signs():
    x, y = np.meshgrid(np.linspace(-10_000.0, 10_000.0, 9), [-2000.0, 0.0, 2000.0])
    x, y = x.ravel(), y.ravel()
    true = np.array([x, y, np.zeros(x.size)])
    names = tuple(str(i) for i in range(x.size))
    z = x + 1j * y
    bent = z + (1e-8 + 2e-8j) * z**2
    strip = np.array([bent.real, bent.imag, 3e-8 * x**2 + 4e-8 * x * y])
    axis = StripAxis(np.zeros(2), np.array([1.0, 0.0]), np.array(10_000.0))
    ground = Ground(names, true, ("control",) * len(names))
    found = strip_adjustment(Model("strip", names, strip), ground, 2, axis).deformation
    assert float(found.scale_drift) == pytest.approx(2e-8, rel=0.01)
    assert float(found.horizontal_bow) == pytest.approx(4e-8, rel=0.01)
    assert float(found.vertical_bow) == pytest.approx(6e-8, rel=0.01)
    assert float(found.twist) == pytest.approx(4e-8, rel=0.01)
    assert float(found.vertical_sag) == pytest.approx(3.0, rel=0.01)
    assert float(found.horizontal_sag) == pytest.approx(2.0, rel=0.01)


def test_control_of_three_bands_leaves_residuals_of_the_size_of_the_nrc_strip(reference):
    """Seventeen A7 models at 1:40 000, nine control points, second degree (ISP): only the magnitude can be compared."""
    text = (reference / "10_a7_grid_strip_nrc.csv").read_text(encoding="utf-8").splitlines()
    rows = [line.split(",") for line in text if not line.startswith("#")][1:]
    nrc = np.array([[float(cell) for cell in row[1:4]] for row in rows])
    rng = np.random.default_rng(17)
    points, centres = flight(rng, photographs=18, base=3600.0, height=6000.0)
    models = perfect_models(rng, points, centres)
    bands = {f"{photo}{row}" for photo in (0, 8, 17) for row in "abc"}
    ground = grounded(points, lambda name: "control" if name in bands else "check")
    of_runs = []
    for _ in range(40):
        noisy = []
        for model in models:
            true = np.array([{**points, **centres}[name] for name in model.points]).T
            size = (
                0.24  # metres, 6 um at the scale of the photographs (A7 grid tests: 4 to 7), in all three coordinates
            )
            local = model.coordinates
            scale = np.linalg.norm(local[:, 1] - local[:, 0]) / np.linalg.norm(true[:, 1] - true[:, 0])
            noisy.append(Model(model.name, model.points, local + size * scale * rng.standard_normal(local.shape)))
        oriented = absolute_orientation(formed_strip(noisy), ground)
        of_runs.append(root_mean_square(strip_adjustment(oriented.model, ground, 2).fit.at_control))
    found, printed = np.sqrt((np.array(of_runs) ** 2).mean(axis=0)), np.sqrt((nrc**2).mean(axis=0))
    assert (found < printed).all()
    assert (found > printed / 2.0).all()


def test_three_bands_of_control_do_not_determine_the_third_degree():
    x, y = np.meshgrid([0.0, 1000.0, 2000.0], [-300.0, 0.0, 300.0])
    places = np.array([x.ravel(), y.ravel(), np.zeros(9)])
    names = tuple(str(i) for i in range(9))
    model, ground = Model("strip", names, places), Ground(names, places, ("control",) * 9)
    assert strip_adjustment(model, ground, 2).height.redundancy == 4
    with pytest.raises(Undetermined):
        strip_adjustment(model, ground, 3)
    with pytest.raises(Undetermined, match="apart from each other"):
        strip_axis(Model("heap", names, 0.0 * places))
    with pytest.raises(Undetermined, match="at least 5"):
        strip_adjustment(model, Ground(names[:4], places[:, :4], ("control",) * 4), 2)
    with pytest.raises(A7SimError, match="degree"):
        strip_adjustment(model, ground, 4)


# --- blocks -------------------------------------------------------------------------------------------------------


def block_of(rng, along, strips, noise=0.0):
    """Models of parallel strips, 60 % by a third of overlap, in systems of their own, and the ground."""
    places = {
        f"{i}_{j}": np.array([1000.0 * i, 1000.0 * j, 50.0 * rng.standard_normal()])
        for i in range(along + 1)
        for j in range(2 * strips + 1)
    }
    models = []
    for s in range(strips):
        for i in range(along):
            names = [f"{a}_{b}" for a in (i, i + 1) for b in range(2 * s, 2 * s + 3)]
            centres = [np.array([1000.0 * a, 1000.0 * (2 * s + 1), 1500.0]) for a in (i, i + 1)]
            true = np.array([*(places[name] for name in names), *centres]).T
            turn = rotation(*(rng.standard_normal(3) * (0.03, 0.03, 2.0)))
            local = turn.T @ (true - true[:, :1]) / rng.uniform(3.5, 4.5) + rng.uniform(-100, 100, (3, 1))
            names += [f"{s}/{a}:centre" for a in (i, i + 1)]
            models.append(Model(f"{s}.{i}", tuple(names), local + noise * rng.standard_normal(local.shape)))
    corners = {f"{i}_{j}" for i in (0, along // 2, along) for j in (0, strips, 2 * strips)}
    return models, grounded(places, lambda name: "control" if name in corners else "check")


@examples(20)
@given(SEEDS)
def test_a_block_without_errors_is_recovered_in_any_order(seed):
    rng = np.random.default_rng(seed)
    models, ground = block_of(rng, 4, 2)
    found = block_adjustment([models[i] for i in rng.permutation(len(models))], ground)
    assert np.abs(found.fit.residuals).max() < 1e-9 * 4000.0
    assert found.iterations <= 8


def test_a_blocks_s0_is_the_error_of_its_models_and_plan_and_height_roles_count():
    rng = np.random.default_rng(2)
    models, ground = block_of(rng, 12, 5, noise=0.01)
    found = block_adjustment(models, ground)
    assert found.s0 == pytest.approx(0.04, rel=0.1)
    assert found.s0_plan == pytest.approx(0.04, rel=0.15)
    assert found.s0_height == pytest.approx(0.04, rel=0.15)
    assert found.sigmas.shape == (7, 60)
    roles = ("plan" if role == "control" and i % 2 else role for i, role in enumerate(ground.roles))
    fewer = block_adjustment(models, Ground(ground.points, ground.coordinates, tuple(roles)))
    assert fewer.redundancy == found.redundancy - sum(
        role == "control" and i % 2 == 1 for i, role in enumerate(ground.roles)
    )


def test_one_model_as_a_block_is_its_absolute_orientation():
    rng = np.random.default_rng(2)
    points, centres = flight(rng, photographs=2)
    model = perfect_models(rng, points, centres)[0]
    model = Model(model.name, model.points, model.coordinates + 1e-3 * rng.standard_normal(model.coordinates.shape))
    ground = grounded(points, lambda name: "control")
    alone, block = absolute_orientation(model, ground), block_adjustment([model], ground)
    assert block.scales[0] == pytest.approx(float(alone.similarity.scale), rel=1e-9)
    np.testing.assert_allclose(block.translations[:, 0], alone.similarity.translation, atol=1e-6)
    assert block.s0 == pytest.approx(float(alone.similarity.s0), rel=1e-6)
    assert block.sigmas[0, 0] == pytest.approx(float(alone.similarity.sigma_scale), rel=1e-6)


def test_blocks_without_sufficient_connections_are_rejected():
    rng = np.random.default_rng(2)
    models, ground = block_of(rng, 3, 1)
    only = Ground(ground.points, ground.coordinates, ("check",) * len(ground.points))
    with pytest.raises(Undetermined, match="two control points in plan"):
        block_adjustment(models, only)
    apart = Model("apart", ("90", "91", "92", "93"), rng.standard_normal((3, 4)))
    again = Model("again", ("90", "91", "92", "93"), rng.standard_normal((3, 4)))
    with pytest.raises(Undetermined, match=r"^the ties and the control leave"):
        block_adjustment([*models, apart, again], ground)
    heap = Model("heap", models[2].points, np.zeros_like(models[2].coordinates))
    with pytest.raises(Undetermined, match=r"^44 equations leave some of 22 unknowns"):
        block_adjustment([*models[:2], heap], ground)
    three = Model("three", ("a", "b", "c"), rng.standard_normal((3, 3)))
    heaped = Ground(("a", "b", "c"), np.zeros((3, 3)), ("control", "control", "height"))
    with pytest.raises(Undetermined, match="extent in plan"):
        block_adjustment([three], heaped)
    with pytest.raises(A7SimError, match="500"):
        block_adjustment([], ground)
    with pytest.raises(A7SimError, match="every model once"):
        block_adjustment([models[0], models[0]], ground)
    plan = Ground(("0_0", "3_2"), ground.among(("0_0", "3_2")).coordinates, ("control", "control"))
    with pytest.raises(Undetermined, match="three control points in height, got 2"):
        block_adjustment(models, plan)


@pytest.mark.slow
def test_five_hundred_models_are_adjusted_together():
    models, ground = block_of(np.random.default_rng(1), 25, 20, noise=0.01)
    found = block_adjustment(models, ground)
    assert len(found.names) == 500
    assert found.s0 == pytest.approx(0.04, rel=0.05)


def test_only_the_block_adjustment_imports_scipy():
    code = "import sys; import a7sim.reduction.block, a7sim.reduction.cards; print('scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_centres_are_recognised_by_their_names():
    assert is_centre("321:centre")
    assert not is_centre("321")
