"""Rules of geometry.md: rotation, rays, the parallax equation and its coefficients."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from a7sim.geometry import (
    GON,
    PARALLAX_ELEMENTS,
    angle_between,
    angles_of,
    at_level,
    image_of,
    length_of,
    mxm,
    near_vertical_parallax_coefficients,
    parallax_coefficients,
    ray_of,
    refraction_constant,
    rotation,
    stereoscopic_intersection,
    transposed,
    turn_of,
    y_parallax,
)

tilts = st.floats(-30.0 * GON, 30.0 * GON)
swings = st.floats(-200.0 * GON, 200.0 * GON)
angles = st.tuples(tilts, tilts, swings).map(np.array)
pictures = st.tuples(st.floats(-100.0, 100.0), st.floats(-100.0, 100.0)).map(np.array)


@given(angles)
def test_rotation_is_scipys_intrinsic_xyz(each):
    np.testing.assert_allclose(rotation(*each), Rotation.from_euler("XYZ", each).as_matrix(), atol=1e-14)


def test_rotation_is_the_matrix_of_the_thesis():
    w, f, k = 0.02, -0.05, 0.3
    # Thesis 2.2-2.3, transposed: rows X, Y, Z of the instrument frame.
    printed = [
        [np.cos(f) * np.cos(k), -np.cos(f) * np.sin(k), np.sin(f)],
        [
            np.cos(w) * np.sin(k) + np.sin(w) * np.sin(f) * np.cos(k),
            np.cos(w) * np.cos(k) - np.sin(w) * np.sin(f) * np.sin(k),
            -np.sin(w) * np.cos(f),
        ],
        [
            np.sin(w) * np.sin(k) - np.cos(w) * np.sin(f) * np.cos(k),
            np.sin(w) * np.cos(k) + np.cos(w) * np.sin(f) * np.sin(k),
            np.cos(w) * np.cos(f),
        ],
    ]
    np.testing.assert_allclose(rotation(w, f, k), printed, atol=1e-15)


def test_the_a8_papers_matrix_is_the_same_rotation_with_z_down():
    a1, a2, a3 = 0.3, -0.05, 0.02  # kappa, phi, omega of paper P, formula 1.2, a33 corrected
    c1, s1, c2, s2, c3, s3 = np.cos(a1), np.sin(a1), np.cos(a2), np.sin(a2), np.cos(a3), np.sin(a3)
    printed = np.array(
        [
            [c2 * c1, -c2 * s1, -s2],
            [s3 * s2 * c1 + c3 * s1, -s3 * s2 * s1 + c3 * c1, s3 * c2],
            [c3 * s2 * c1 - s3 * s1, -c3 * s2 * s1 - s3 * c1, c3 * c2],
        ]
    )
    down = np.diag([1.0, 1.0, -1.0])
    np.testing.assert_allclose(printed, down @ rotation(a3, a2, a1) @ down, atol=1e-15)


@given(angles)
def test_angles_of_undoes_rotation(each):
    np.testing.assert_allclose(rotation(*angles_of(rotation(*each))), rotation(*each), atol=1e-13)


@given(st.floats(1e-7, 3.1), angles)
def test_turn_of_is_the_angle_of_a_rotation(angle, about):
    small = rotation(angle, 0.0, 0.0)
    base = rotation(*about)
    assert turn_of(mxm(mxm(base, small), transposed(base))) == pytest.approx(angle, rel=1e-8)


def test_angle_between_is_exact_for_small_angles():
    assert angle_between(np.array([1.0, 0.0, 0.0]), np.array([1.0, 1e-9, 0.0])) == pytest.approx(1e-9, rel=1e-9)


def test_angles_between_many_vectors_equal_the_angle_of_each_pair():
    first, second = np.random.default_rng(2).standard_normal((2, 3, 5))
    each = [angle_between(u, v) for u, v in zip(first.T, second.T, strict=True)]
    np.testing.assert_allclose(angle_between(first, second), each, rtol=1e-14)


@pytest.mark.parametrize("height", [4000.0, 6000.0, 9000.0])
def test_bertrams_refraction_over_the_sea_equals_a_ray_through_the_standard_atmosphere(height):
    """A ray bends where the refractive index falls; n - 1 is 2.26e-4 times the density in kg/m3 (ICAO)."""
    z = np.linspace(0.0, height, 2001)
    n = 1.0 + 2.26e-4 * 1.225 * (1.0 - 22.558e-6 * z) ** 4.2559
    bending = np.trapezoid(-np.gradient(n, z) * z, z) / height
    assert refraction_constant(height, 0.0) == pytest.approx(bending, rel=0.1)


@given(angles, pictures, st.floats(98.0, 215.0), st.floats(-490.0, -140.0))
def test_the_point_of_a_ray_is_imaged_at_the_origin_of_the_ray(each, picture, c, level):
    centre = np.array([5.0, -3.0, 1.0])
    ray = ray_of(picture, rotation(*each), c)
    if ray[2] < -1.0:
        seen = image_of(at_level(centre, ray, level), centre, rotation(*each), c)
        np.testing.assert_allclose(seen, picture, atol=1e-9)


@given(angles, angles, pictures, st.floats(-450.0, -150.0))
def test_two_rays_of_one_point_meet_in_it_without_parallax(left, right, plan, level):
    point = np.array([plan[0] + 100.0, plan[1], level])
    centre1, centre2 = np.zeros(3), np.array([195.0, -4.0, 3.0])
    met, p = stereoscopic_intersection(centre1, point - centre1, centre2, point - centre2)
    np.testing.assert_allclose(met, point, atol=1e-8)
    assert abs(p) < 1e-8


@given(pictures, pictures, angles, angles)
def test_the_x_parallax_vanishes_at_the_mark(image1, image2, angles1, angles2):
    centre1, centre2 = np.zeros(3), np.array([195.0, -4.0, 3.0])
    small = 0.1
    r1, r2 = rotation(*(small * angles1)), rotation(*(small * angles2))
    image1 = image1 + np.array([120.0, 0.0])
    met, p = stereoscopic_intersection(centre1, ray_of(image1, r1, 152.0), centre2, ray_of(image2 * 0.1, r2, 152.0))
    if -2000.0 < met[2] < -50.0:
        left = at_level(centre1, ray_of(image1, r1, 152.0), met[2])
        right = at_level(centre2, ray_of(image2 * 0.1, r2, 152.0), met[2])
        assert left[0] == pytest.approx(right[0], abs=1e-6)
        assert left[1] - right[1] == pytest.approx(float(p), abs=1e-6)


def _parallax(elements, image1, image2, x1, x2, level):
    e = dict(zip(PARALLAX_ELEMENTS, elements, strict=True))
    centre1 = np.array([x1, -e["by1"], e["bz1"]])
    centre2 = np.array([x2, -e["by2"], e["bz2"]])
    r1 = rotation(e["omega1"], e["phi1"], e["kappa1"])
    r2 = rotation(e["omega2"], e["phi2"], e["kappa2"])
    return y_parallax(image1, image2, centre1, centre2, r1, r2, 152.0, 153.0, level)


@given(
    st.lists(st.floats(-0.3, 0.3), min_size=6, max_size=6),
    st.lists(st.floats(-20.0, 20.0), min_size=4, max_size=4),
    st.sampled_from(["inside", "outside"]),
    st.tuples(st.floats(-60.0, 60.0), st.floats(-60.0, 60.0)),
    st.floats(-400.0, -250.0),
)
def test_parallax_coefficients_are_the_derivatives_at_any_tilt_and_base(tilt, shifts, base, spot, level):
    elements = np.array([*tilt, *shifts])
    # With base out the right projector holds the left-hand photograph; the left-hand centre is at X = 0 in both.
    x1, x2 = (0.0, 195.0) if base == "inside" else (0.0, 160.0)
    image1, image2 = np.array(spot), np.array(spot) * 0.5 - np.array([40.0, 0.0])
    numerical = []
    for i in range(10):
        h = 1e-5 if i < 6 else 1e-3
        step = np.eye(10)[i] * h
        above = _parallax(elements + step, image1, image2, x1, x2, level)
        below = _parallax(elements - step, image1, image2, x1, x2, level)
        numerical.append((above - below) / (2.0 * h))
    e = dict(zip(PARALLAX_ELEMENTS, elements, strict=True))
    stands = []
    for n, x, image, c in ((1, x1, image1, 152.0), (2, x2, image2, 153.0)):
        centre = np.array([x, -e[f"by{n}"], e[f"bz{n}"]])
        turned = np.array([e[f"omega{n}"], e[f"phi{n}"], e[f"kappa{n}"]])
        stands.append((at_level(centre, ray_of(image, rotation(*turned), c), level), centre, turned))
    (point1, centre1, angles1), (point2, centre2, angles2) = stands
    found = parallax_coefficients(point1, point2, centre1, centre2, angles1, angles2)
    np.testing.assert_allclose(found, numerical, rtol=1e-5, atol=1e-4)


@given(st.floats(-50.0, 250.0), st.floats(-200.0, 200.0), st.floats(140.0, 490.0), st.floats(50.0, 280.0))
def test_near_the_vertical_the_coefficients_equal_the_thesis(x, y, z, b):
    point = np.array([x, y, -z])
    zero = np.zeros(3)
    found = parallax_coefficients(point, point, zero, np.array([b, 0.0, 0.0]), zero, zero)
    np.testing.assert_allclose(found, near_vertical_parallax_coefficients(x, y, z, b), rtol=1e-12, atol=1e-10)


def test_a_positive_by_moves_a_centre_towards_minus_y():
    """geometry.md: with by" at zero, by' is turned until p vanishes and then reads +p."""
    image1, image2 = np.array([30.0, 20.0]), np.array([-60.0, 19.0])
    elements = np.zeros(10)
    p = _parallax(elements, image1, image2, 0.0, 195.0, -325.0)
    assert p > 1.0
    by1 = PARALLAX_ELEMENTS.index("by1")
    by2 = PARALLAX_ELEMENTS.index("by2")
    assert _parallax(elements + p * np.eye(10)[by1], image1, image2, 0.0, 195.0, -325.0) == pytest.approx(0.0)
    assert _parallax(elements - p * np.eye(10)[by2], image1, image2, 0.0, 195.0, -325.0) == pytest.approx(0.0)


def test_one_call_serves_a_point_a_model_and_a_batch():
    rng = np.random.default_rng(1)
    images = rng.uniform(-90.0, 90.0, (2, 15, 4))
    w, f, k = rng.uniform(-0.05, 0.05, (3, 15, 4))
    centre = np.array([1.0, 2.0, 3.0])
    shaped = centre.reshape(3, 1, 1)
    turned = rotation(w, f, k)
    together = at_level(shaped, ray_of(images, turned, 152.0), -325.0)
    back = image_of(together, shaped, turned, 152.0)
    np.testing.assert_allclose(back, images, atol=1e-10)
    coefficients = parallax_coefficients(
        together, together, shaped, shaped + 1.0, np.array([w, f, k]), np.array([w, f, k])
    )
    assert coefficients.shape == (10, 15, 4)
    one = parallax_coefficients(
        together[:, 3, 2],
        together[:, 3, 2],
        centre,
        centre + 1.0,
        np.array([w, f, k])[:, 3, 2],
        np.array([w, f, k])[:, 3, 2],
    )
    np.testing.assert_allclose(coefficients[:, 3, 2], one)
    assert length_of(together).shape == (15, 4)
