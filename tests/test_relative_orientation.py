"""Relative orientation from image coordinates: published results, exact recovery, four methods, errors."""

import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a7sim.geometry import image_of, mxm, rotation, transposed, turn_of
from a7sim.reduction import ProjectorPose, Undetermined, element_corrections
from a7sim.reduction.coplanarity import relative_orientation
from a7sim.reduction.hallert import orientation_by_parallaxes, six_point_corrections
from a7sim.reduction.modelling import a8_model_coordinates, model_coordinates
from a7sim.reduction.relative_poses import _facing, relative_poses
from a7sim.reduction.schut import orientation_by_schut
from a7sim.reduction.snooping import snooped_orientation, standardised_residuals

C = 152.0
BASE = 92.0
SIX = np.array([(x, y) for y in (0.0, 1.0, -1.0) for x in (0.0, 1.0)]).T
NINE = np.array([(x, y) for y in (0.0, 1.0, -1.0) for x in (0.0, 0.5, 1.0)]).T
FIFTEEN = np.array([(x, y) for y in (0.0, 1.0, -1.0) for x in (0.0, 0.25, 0.5, 0.75, 1.0)]).T
DEPENDENT = ("omega2", "phi2", "kappa2", "by2", "bz2")


def pairs_of(rng, tilt_deg, plan=SIX, noise=0.0, batch=(), relief=0.1, together=False):
    """Images of points about a plan (in bases), each angle drawn within the tilt (omega and phi together or each)."""
    tilt = np.radians(tilt_deg)
    angles = rng.uniform(-tilt, tilt, (2, 3, *batch))
    if together:
        direction = rng.uniform(0.0, 2.0 * np.pi, batch)
        angles[1, :2] = np.array([np.cos(direction), np.sin(direction)]) * np.abs(angles[1, 0])
    angles[0, 0] = 0.0  # position of the frame about the base
    n = plan.shape[1]
    z = -C * (1.0 + rng.uniform(-relief, relief, (1, n, *batch)))
    points = np.concatenate([np.broadcast_to(BASE * plan.reshape((2, n, *(1,) * len(batch))), (2, n, *batch)), z])
    turns = [rotation(*each) for each in angles]
    centres = np.array([[0.0, BASE], [0.0, 0.0], [0.0, 0.0]]).T.reshape((2, 3, 1, *(1,) * len(batch)))
    images = [
        image_of(points, centre, turn[:, :, None], C) + noise * rng.standard_normal((2, n, *batch))
        for centre, turn in zip(centres, turns, strict=True)
    ]
    return *images, mxm(transposed(turns[0]), turns[1]), turns[0][0], angles


def images_in(table, x0_y0=(0.0, 0.0)):
    shift = np.array(x0_y0)[:, None]
    return tuple(np.array([(p[x], p[y]) for p in table]).T - shift for x, y in (("xl", "yl"), ("xr", "yr")))


def loaded(reference, name):
    return tomllib.loads((reference / name).read_text(encoding="utf-8"))


# Published oracles


def test_calgarys_first_pair_is_reproduced_to_the_printed_digits(reference):
    """Reproduce by, bz, omega, phi, kappa, y-parallaxes (there right minus left) and model of the lab report."""
    data = loaded(reference, "02_calgary_lab_pair_27_28.toml")
    pair, c, bx = data["relative_a"], data["c_mm"], data["bx_mm"]
    images = images_in(pair["points"])
    schut = orientation_by_schut(*images, c, c, bx)
    np.testing.assert_allclose(schut.centre2[1:], (-1.421794, -1.287246), atol=6e-7)
    np.testing.assert_allclose(np.degrees(schut.angles2), (-0.977230, 0.273260, -1.728627), atol=6e-7)
    found = relative_orientation(*images, c, c, "dependent", bx=bx)
    np.testing.assert_allclose(found.centre2[1:], pair["expected_by_bz_mm"], atol=6e-4)
    np.testing.assert_allclose(np.degrees(found.angles2), pair["expected_omega_phi_kappa_deg"], atol=1e-4)
    np.testing.assert_allclose(-found.picture_parallaxes, pair["expected_y_parallax_mm"], atol=6e-4)
    length = np.linalg.norm(found.centre2)
    model, parallaxes = model_coordinates(*images, c, c, found.rotation, found.base, length)
    printed = np.array([[p["model_x"], p["model_y"], p["model_z"]] for p in pair["points"]]).T
    np.testing.assert_allclose(model, printed, atol=2e-3)
    np.testing.assert_allclose(-parallaxes, pair["expected_y_parallax_mm"], atol=6e-4)


def test_calgarys_second_pair_is_reproduced(reference):
    data = loaded(reference, "02_calgary_lab_pair_27_28.toml")
    by, bz, omega, phi, kappa = data["relative_b"]["expected"]
    images = images_in(data["relative_b"]["points"])
    schut = orientation_by_schut(*images, data["c_mm"], data["c_mm"], data["bx_mm"])
    np.testing.assert_allclose(schut.adjustment.unknowns, (omega, phi, kappa, by, bz), atol=1e-9)
    found = relative_orientation(*images, data["c_mm"], data["c_mm"], "dependent", bx=data["bx_mm"])
    np.testing.assert_allclose(found.adjustment.unknowns[:3], (omega, phi, kappa), atol=1e-6)
    np.testing.assert_allclose(found.adjustment.unknowns[3:], (by, bz), atol=1e-4)


def test_results_of_dewitts_program_are_reproduced_with_their_standard_deviations(reference):
    data = loaded(reference, "03_dewitt_public_domain.toml")["relative_orientation"]
    images, c = images_in(data["points"]), data["c_mm"]
    bx, by, bz = data["expected_base_mm"]
    found = relative_orientation(*images, c, c, "dependent", bx=bx)
    np.testing.assert_allclose(np.degrees(found.angles2), data["expected_omega_phi_kappa_deg"], atol=5.1e-5)
    np.testing.assert_allclose(np.degrees(found.adjustment.sigmas[:3]), data["expected_sd_deg"], atol=5.1e-5)
    np.testing.assert_allclose(found.centre2, (bx, by, bz), atol=5.1e-5)
    np.testing.assert_allclose(found.adjustment.sigmas[3:], data["expected_sd_YL_ZL_mm"], atol=5.1e-5)
    assert float(found.s0) == pytest.approx(data["expected_s0_mm"], abs=5.1e-5)
    np.testing.assert_allclose(found.corrections1[1], data["expected_y_residual_left_mm"], atol=5.1e-5)
    model, _ = model_coordinates(*images, c, c, found.rotation, found.base, np.linalg.norm(found.centre2))
    printed = np.array([[p["X"], p["Y"], p["Z"] - c] for p in data["expected_object"]]).T
    np.testing.assert_allclose(model, printed, atol=2e-3)


def test_the_strips_of_wuhan_leave_the_residuals_listed(reference):
    data = loaded(reference, "05_wuhan_two_strips.toml")
    x0, y0 = data["x0_y0_mm"]
    photos = {}
    for each in data["data"]["image"]:
        photos.setdefault(str(each["photo"]), {})[each["id"]] = (each["x"] - x0, each["y"] - y0)
    for pair, rms_um in data["expected"]["ro_rms_sampson_um"].items():
        left, right = (photos[name] for name in pair.split("-"))
        both = [point for point in left if point in right]
        images = (np.array([photo[point] for point in both]).T for photo in (left, right))
        found = relative_orientation(*images, data["c_mm"], data["c_mm"])
        assert 1000.0 * np.sqrt((found.adjustment.residuals**2).mean()) == pytest.approx(rms_um, abs=0.0051)


def test_independent_and_dependent_leave_the_same_residual_sum(reference):
    data = loaded(reference, "07_yzcg_pairs_mit.toml")
    images = images_in(data["points"], data["x0_y0_mm"])
    sums = []
    for unknowns, omega in (("independent", 1), ("independent", 2), ("dependent", 2)):
        found = relative_orientation(*images, data["c_mm"], data["c_mm"], unknowns, omega)
        assert found.converged
        sums.append((found.adjustment.residuals**2).sum())
    np.testing.assert_allclose(sums, sums[0], rtol=1e-8)


def test_hallerts_cofactors_hold_for_the_rigorous_solution_of_vertical_photographs(reference):
    numbers = loaded(reference, "09_hallert_cofactors.toml")["numeric_b92_d92_h152"]
    x, y = BASE * SIX
    left, right = np.array([x, y]), np.array([x - BASE, y])
    rows = {
        ("independent", 1): ("kappa1", "kappa2", "phi1", "phi2", "omega1"),
        ("dependent", 2): ("by2", "bz2", "kappa2", "phi2", "omega2"),
    }
    for (unknowns, omega), order in rows.items():
        found = relative_orientation(left, right, C, C, unknowns, omega, bx=BASE)
        # a weight of 1 for one image coordinate is a half for their difference, the y-parallax
        cofactors = np.diag(found.adjustment.cofactors) / 2.0
        expected = numbers["swing_k1_k2_f1_f2_w1" if omega == 1 else "dependent_by_bz_kappa_phi_omega"]
        got = [cofactors[found.unknowns.index(name)] for name in order]
        np.testing.assert_allclose(got, expected, rtol=3e-5 if omega == 1 else 1e-9)


@given(st.lists(st.floats(-0.1, 0.1), min_size=6, max_size=6), st.floats(60.0, 100.0), st.floats(60.0, 100.0))
def test_hallerts_closed_forms_are_the_least_squares_solution(parallaxes, b, d):
    h = 152.0
    plan = [(0.0, 0.0), (b, 0.0), (0.0, d), (b, d), (0.0, -d), (b, -d)]
    points = np.array([(x, y, -h) for x, y in plan]).T
    left, right = ProjectorPose(np.zeros(3), np.zeros(3)), ProjectorPose(np.array([b, 0.0, 0.0]), np.zeros(3))
    names = ("by2", "bz2", "kappa2", "phi2", "omega2")
    expected = element_corrections(np.array(parallaxes), points, left, right, names)
    closed, s0 = six_point_corrections(np.array(parallaxes), b, d, h)
    np.testing.assert_allclose([closed[name] for name in names], expected.unknowns, atol=1e-11)
    assert float(s0) == pytest.approx(float(expected.s0), abs=1e-11)


# Properties


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([6, 9, 15]), st.floats(0.0, 20.0))
def test_any_pair_without_errors_is_recovered(seed, n, tilt):
    images = pairs_of(np.random.default_rng(seed), tilt, {6: SIX, 9: NINE, 15: FIFTEEN}[n])
    image1, image2, expected, base, angles = images
    found = relative_orientation(image1, image2, C, C, bx=BASE)
    assert float(turn_of(mxm(transposed(found.rotation), expected))) < 1e-9
    np.testing.assert_allclose(found.base, base, atol=1e-9)
    np.testing.assert_allclose(found.angles1, angles[0], atol=1e-9)
    np.testing.assert_allclose(found.angles2, angles[1], atol=1e-9)
    assert set(found.elements) == {"kappa1", "kappa2", "phi1", "phi2", "omega2"}


@pytest.mark.parametrize(("tilt", "iterations"), [(5.0, 3), (20.0, 5)])
@pytest.mark.parametrize("plan", [SIX, NINE, FIFTEEN])
def test_a_thousand_pairs_converge_in_the_iterations_of_paper_p(tilt, iterations, plan):
    """Paper P has three iterations for tilts to 5 deg and five for 20 deg; here from zero to 1e-10 rad."""
    image1, image2, expected, base, angles = pairs_of(
        np.random.default_rng(1968), tilt, plan, batch=(1000,), together=True
    )
    assert np.degrees(np.hypot(angles[1, 0], angles[1, 1])).max() > 0.98 * tilt
    found = relative_poses(image1, image2, C, C)
    assert found.converged.all()
    assert found.iterations.max() <= iterations
    assert turn_of(mxm(transposed(found.rotation), expected)).max() < 1e-10
    assert np.abs(found.base - base).max() < 1e-10


@pytest.mark.parametrize("plan", [SIX, NINE, FIFTEEN])
def test_a_pair_with_twenty_degrees_in_every_angle_is_oriented(plan):
    image1, image2, expected, *_ = pairs_of(np.random.default_rng(1969), 20.0, plan, batch=(5000,))
    found = relative_poses(image1, image2, C, C)
    assert found.converged.all()
    assert (found.iterations <= 5).mean() > 0.998
    assert turn_of(mxm(transposed(found.rotation), expected)).max() < 1e-9


@pytest.mark.parametrize(("tilt", "iterations"), [(5.0, 3), (20.0, 5)])
def test_errors_of_measurement_add_no_iteration(tilt, iterations):
    image1, image2, *_ = pairs_of(np.random.default_rng(7), tilt, NINE, noise=0.005, batch=(1000,), together=True)
    found = relative_poses(image1, image2, C, C)
    assert found.converged.all()
    assert found.iterations.max() <= iterations + 1
    assert (found.iterations <= iterations).mean() > 0.99
    again = relative_poses(image1, image2, C, C, tolerance=1e-14)
    assert turn_of(mxm(transposed(found.rotation), again.rotation)).max() < 1e-9


def test_four_methods_agree_within_three_standard_deviations():
    rng = np.random.default_rng(23)
    image1, image2, *_ = pairs_of(rng, 4.0, NINE, noise=0.005)
    rigorous = relative_orientation(image1, image2, C, C, "dependent", bx=BASE)
    without_fourth = relative_orientation(
        *(np.delete(i, 3, axis=1) for i in (image1, image2)), C, C, "dependent", bx=BASE
    )
    spoilt = image1.copy()
    spoilt[1, 3] += 0.2
    others = {
        "Schut": (orientation_by_schut(image1, image2, C, C, BASE), rigorous, 0.05, 0.01),
        "parallaxes": (orientation_by_parallaxes(image1, image2, C, C, "dependent", bx=BASE), rigorous, 0.3, 0.06),
        "snooped": (
            snooped_orientation(spoilt, image2, C, C, sigma=0.005, unknowns="dependent", bx=BASE).orientation,
            without_fourth,
            1e-6,
            1e-6,
        ),
    }
    for found, expected, away_by, sigmas_by in others.values():
        assert found.unknowns == DEPENDENT
        away = np.abs(found.adjustment.unknowns - expected.adjustment.unknowns) / expected.adjustment.sigmas
        assert away.max() < away_by
        np.testing.assert_allclose(found.adjustment.sigmas, expected.adjustment.sigmas, rtol=sigmas_by)
    independent = relative_orientation(image1, image2, C, C)
    by_parallaxes = orientation_by_parallaxes(image1, image2, C, C)
    away = by_parallaxes.adjustment.unknowns - independent.adjustment.unknowns
    assert (np.abs(away) < 3.0 * independent.adjustment.sigmas).all()


def test_the_choice_of_unknowns_does_not_change_the_orientation():
    image1, image2, *_ = pairs_of(np.random.default_rng(3), 8.0, FIFTEEN, noise=0.005)
    found = [relative_orientation(image1, image2, C, C, *each) for each in (("independent", 1), ("independent", 2))]
    found.append(relative_orientation(image1, image2, C, C, "dependent", bx=BASE))
    for each in found[1:]:
        np.testing.assert_allclose(each.rotation, found[0].rotation, atol=1e-12)
        np.testing.assert_allclose(each.base, found[0].base, atol=1e-12)
        np.testing.assert_allclose(each.adjustment.residuals, found[0].adjustment.residuals, atol=1e-9)
        np.testing.assert_allclose(
            each.adjustment.redundancy_numbers, found[0].adjustment.redundancy_numbers, atol=1e-6
        )
    assert found[0].angles2[0] == pytest.approx(0.0, abs=1e-15)
    assert found[1].angles1[0] == pytest.approx(0.0, abs=1e-15)


def test_sigmas_are_the_spread_of_ten_thousand_orientations():
    rng = np.random.default_rng(5)
    image1, image2, *_ = pairs_of(rng, 3.0, NINE)
    noisy = [image[..., None] + 0.005 * rng.standard_normal((2, 9, 10_000)) for image in (image1, image2)]
    found = relative_orientation(*noisy, C, C)
    assert np.sqrt((found.s0**2).mean()) == pytest.approx(0.005, rel=0.02)
    spread = found.adjustment.unknowns.std(axis=1)
    np.testing.assert_allclose(np.sqrt((found.adjustment.sigmas**2).mean(axis=1)), spread, rtol=0.03)


@pytest.mark.parametrize("method", [relative_orientation, orientation_by_schut, orientation_by_parallaxes])
def test_the_order_of_points_does_not_matter(method):
    rng = np.random.default_rng(9)
    image1, image2, *_ = pairs_of(rng, 5.0, NINE, noise=0.005)
    order = rng.permutation(9)
    one, other = method(image1, image2, C, C), method(image1[:, order], image2[:, order], C, C)
    np.testing.assert_allclose(other.adjustment.unknowns, one.adjustment.unknowns, atol=1e-10)
    np.testing.assert_allclose(other.adjustment.residuals, one.adjustment.residuals[order], atol=1e-8)


@pytest.mark.parametrize("method", [relative_orientation, orientation_by_schut, orientation_by_parallaxes])
def test_a_batch_gives_the_results_of_its_members(method):
    image1, image2, *_ = pairs_of(np.random.default_rng(2), 6.0, NINE, noise=0.005, batch=(3, 2))
    together = method(image1, image2, C, C)
    for at in np.ndindex(3, 2):
        one = method(image1[(..., *at)], image2[(..., *at)], C, C)
        np.testing.assert_allclose(together.rotation[(..., *at)], one.rotation, atol=1e-10)
        np.testing.assert_allclose(together.adjustment.unknowns[(..., *at)], one.adjustment.unknowns, atol=1e-10)
        np.testing.assert_allclose(together.adjustment.sigmas[(..., *at)], one.adjustment.sigmas, rtol=1e-6)
        np.testing.assert_allclose(together.s0[at], one.s0, rtol=1e-6)
        assert together.iterations[at] == one.iterations
    model, parallaxes = model_coordinates(image1, image2, C, C, together.rotation, together.base, BASE)
    one = model_coordinates(
        image1[..., 1, 1], image2[..., 1, 1], C, C, together.rotation[..., 1, 1], together.base[..., 1, 1], BASE
    )
    np.testing.assert_allclose(model[..., 1, 1], one[0], atol=1e-12)
    np.testing.assert_allclose(parallaxes[..., 1, 1], one[1], atol=1e-12)


def test_near_and_far_start_values_in_one_batch_give_the_results_of_its_members():
    """Pairs near zero are solved together, the others after them in sets; the results do not depend on it."""
    near, far = (
        pairs_of(np.random.default_rng(seed), tilt, SIX, noise=0.005, batch=(3000,))
        for seed, tilt in ((11, 1.0), (12, 15.0))
    )
    image1, image2 = (np.concatenate([near[i], far[i]], axis=-1) for i in (0, 1))
    shuffled = np.random.default_rng(13).permutation(6000)
    found = relative_poses(image1[..., shuffled], image2[..., shuffled], C, C)
    assert found.converged.all()
    for at in range(0, 6000, 300):
        one = relative_poses(image1[..., shuffled[at]], image2[..., shuffled[at]], C, C)
        np.testing.assert_allclose(found.rotations[..., at], one.rotations, atol=1e-9)
        np.testing.assert_allclose(found.s0[at], one.s0, rtol=1e-6)
        assert found.iterations[at] == one.iterations


@pytest.mark.parametrize("over", [1.0, -1.0])
@pytest.mark.parametrize("reversed_", [1.0, -1.0])
def test_of_four_poses_with_coplanar_rays_the_one_with_points_before_both_cameras_is_selected(over, reversed_):
    points = np.concatenate([BASE * NINE, np.full((1, 9), -C)])
    rays = np.array([points, points - np.array([BASE, 0.0, 0.0])[:, None]])
    true = np.array([np.eye(3), np.eye(3)])
    pose = true.copy()
    pose[1, 1:] *= over
    pose[:, :2] *= reversed_
    found, before_both = _facing(pose, np.einsum("cij,cjn->cin", pose, rays))
    np.testing.assert_array_equal(found, true)
    assert before_both


def test_photographs_rotated_in_their_plane_are_oriented():
    image1, image2, expected, *_ = pairs_of(np.random.default_rng(4), 3.0, NINE)
    for quarters in range(4):
        turn = rotation(0.0, 0.0, quarters * np.pi / 2.0)
        found = relative_orientation(turn[:2, :2] @ image1, image2, C, C)
        assert float(turn_of(mxm(transposed(found.rotation), mxm(turn, expected)))) < 1e-9


def test_photographs_may_have_different_principal_distances():
    image1, image2, expected, *_ = pairs_of(np.random.default_rng(4), 3.0, NINE)
    found = relative_orientation(image1 * 2.0, image2, 2.0 * C, C)
    assert float(turn_of(mxm(transposed(found.rotation), expected))) < 1e-9


# Models


def test_model_coordinates_are_the_points_in_the_left_photographs_frame():
    rng = np.random.default_rng(12)
    image1, image2, expected, base, angles = pairs_of(rng, 15.0, FIFTEEN)
    model, parallaxes = model_coordinates(image1, image2, C, C, expected, base, BASE)
    np.testing.assert_allclose(parallaxes, 0.0, atol=1e-10)
    np.testing.assert_allclose(image_of(model, np.zeros((3, 1)), np.eye(3), C), image1, atol=1e-10)
    plan = rotation(*angles[0]) @ model
    np.testing.assert_allclose(plan[:2], BASE * FIFTEEN, atol=1e-9)


def test_a8_readings_become_model_coordinates():
    """P 3.1, 3.2; a base of 80 puts the left centre at X = 180 (history.md: the middle of the base at 180.1)."""
    at_left_centre = a8_model_coordinates(np.array([180.0, 200.0, 100.0]), 80.0, 300.0, 100.0)
    np.testing.assert_allclose(at_left_centre, (0.0, 0.0, -300.0))
    higher = a8_model_coordinates(np.array([[220.0], [150.0], [112.5]]), 80.0, 300.0, 100.0)
    np.testing.assert_allclose(higher, [[80.0], [-100.0], [-287.5]])


# Errors


def test_four_points_do_not_orient_a_pair():
    image1, image2, *_ = pairs_of(np.random.default_rng(0), 1.0, SIX[:, :4])
    for method in (relative_orientation, orientation_by_schut, orientation_by_parallaxes):
        with pytest.raises(Undetermined, match="at least 5 points"):
            method(image1, image2, C, C)


def _vertical_images(points, noise):
    rng = np.random.default_rng(6)
    return tuple(
        image_of(points, np.array([[x], [0.0], [0.0]]), np.eye(3), C) + noise * rng.standard_normal(points[:2].shape)
        for x in (0.0, BASE)
    )


@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_points_on_a_line_are_rejected_with_the_condition_number(noise):
    along = np.linspace(0.0, BASE, 9)
    for rise in (0.0, 0.3):
        images = _vertical_images(np.array([along, rise * along, np.full(9, -C)]), noise)
        with pytest.raises(Undetermined, match="condition number"):
            relative_orientation(*images, C, C)
        for method in (orientation_by_schut, orientation_by_parallaxes):
            with pytest.raises(Undetermined):
                method(*images, C, C)


@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_points_on_a_critical_cylinder_are_rejected_with_the_condition_number(noise):
    """The circular cylinder contains both centres and its axis is along the base: a flight along a valley."""
    around, along = (each.ravel() for each in np.meshgrid(np.linspace(-1.0, 1.0, 5), (0.0, 0.5, 1.0)))
    points = np.array([BASE * along, C / 2.0 * np.sin(around), -C / 2.0 * (1.0 + np.cos(around))])
    images = _vertical_images(points, noise)
    for method in (relative_orientation, orientation_by_schut, orientation_by_parallaxes):
        with pytest.raises(Undetermined, match="condition number"):
            method(*images, C, C)


def test_one_pair_that_cannot_be_oriented_does_not_affect_the_batch():
    image1, image2, *_ = pairs_of(np.random.default_rng(8), 3.0, NINE, batch=(5,))
    image1[:, :, 2] = image1[:, :1, 2]
    found = relative_poses(image1, image2, C, C)
    np.testing.assert_array_equal(found.converged, [True, True, False, True, True])
    with pytest.raises(Undetermined, match="of pair 2"):
        relative_orientation(image1, image2, C, C)


def test_a_pair_without_measurements_changes_no_step_of_the_others():
    """If the rays of one pair are NaN, the steps of pairs far from zero are limited as in a batch of one."""
    image1, image2, *_ = pairs_of(np.random.default_rng(3), 40.0, NINE, batch=(40,))
    alone = relative_poses(image1, image2, C, C)
    nothing = np.full_like(image1[..., :1], np.nan)
    beside = relative_poses(*(np.concatenate([image, nothing], axis=-1) for image in (image1, image2)), C, C)
    np.testing.assert_array_equal(beside.converged, [*alone.converged, False])
    np.testing.assert_array_equal(beside.iterations[:-1], alone.iterations)


def test_five_points_orient_a_pair_without_redundancy():
    image1, image2, expected, *_ = pairs_of(np.random.default_rng(1), 2.0, NINE[:, [0, 2, 3, 5, 6]])
    found = relative_orientation(image1, image2, C, C)
    assert float(turn_of(mxm(transposed(found.rotation), expected))) < 1e-9
    assert float(found.s0) == 0.0
    assert found.adjustment.redundancy == 0


# Blunders


@pytest.mark.parametrize("sigma", [0.005, None])
@pytest.mark.parametrize("blunder", [0.15, -1.0])
def test_the_point_with_the_blunder_is_named_and_excluded(sigma, blunder):
    image1, image2, expected, *_ = pairs_of(np.random.default_rng(31), 3.0, FIFTEEN, noise=0.003)
    image2[1, 7] += blunder
    names = [f"P{i}" for i in range(15)]
    found = snooped_orientation(image1, image2, C, C, names, sigma)
    assert [each.point for each in found.blunders] == ["P7"]
    assert found.blunders[0].parallax_mm == pytest.approx(-blunder, abs=0.05)
    assert "P7" not in found.points
    assert len(found.points) == 14
    assert float(turn_of(mxm(transposed(found.orientation.rotation), expected))) < 5e-4


def test_two_blunders_are_named_one_after_the_other():
    image1, image2, *_ = pairs_of(np.random.default_rng(33), 3.0, FIFTEEN, noise=0.003)
    image1[1, 2] += 0.4
    image2[1, 11] -= 0.2
    found = snooped_orientation(image1, image2, C, C, sigma=0.003)
    assert {each.point for each in found.blunders} == {"3", "12"}


def test_no_sound_observation_is_excluded():
    for seed in range(20):
        image1, image2, *_ = pairs_of(np.random.default_rng(seed), 3.0, NINE, noise=0.004)
        found = snooped_orientation(image1, image2, C, C)
        assert found.searchable
        assert not found.blunders


def test_six_points_cannot_identify_the_wrong_one():
    image1, image2, *_ = pairs_of(np.random.default_rng(2), 3.0, SIX)
    image2[1, 3] += 0.2
    found = snooped_orientation(image1, image2, C, C, sigma=0.005)
    assert not found.searchable
    assert not found.blunders
    np.testing.assert_allclose(np.abs(found.standardised), np.abs(found.standardised[0]), rtol=1e-6)


def test_standardised_residuals_of_sound_observations_have_variance_one():
    image1, image2, *_ = pairs_of(np.random.default_rng(40), 3.0, NINE, noise=0.005, batch=(4000,))
    adjustment = relative_orientation(image1, image2, C, C).adjustment
    w = standardised_residuals(adjustment, 0.005)
    np.testing.assert_allclose(w.std(axis=1), 1.0, atol=0.05)
