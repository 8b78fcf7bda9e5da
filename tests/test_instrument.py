"""The instrument: effect of its parts on rays and view (geometry.md: Counters, Projection centres, Fittings)."""

import dataclasses

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from a7sim.geometry import GON, at_level, ray_of, rotation
from a7sim.instrument import Autograph, OutOfRangeError, SettingsConflictError, build_autograph
from a7sim.instrument.spindles import Counter, Spindle
from a7sim.plotters import A7, POSITIONS_OF, REQUIRED_FITTINGS, VARIANTS, Element
from a7sim.scenario import Condition, ProjectorCondition, load_scenario
from a7sim.scenario.schema import Camera, Fiducial
from a7sim.scene import NamedPoints, Photograph, build_scene
from a7sim.scene.camera import fall_off
from a7sim.scene.emulsion import GRAIN

CAMERA = Camera(
    c=150.0,
    fiducials=[Fiducial(name=str(i), x=x, y=y) for i, (x, y) in enumerate([(-106.0, 0.0), (106.0, 0.0), (0.0, 106.0)])]
    + [Fiducial(name="3", x=0.0, y=-106.0)],
)


def photograph(name, points, **changes):
    marks = NamedPoints(tuple(points), np.array(list(points.values()), dtype=float).T)
    fiducials = NamedPoints(tuple(f.name for f in CAMERA.fiducials), np.array([(f.x, f.y) for f in CAMERA.fiducials]).T)
    return dataclasses.replace(Photograph(name, CAMERA, fiducials, marks, marks), **changes)


def plotter(left=None, right=None, condition=None, polarity="positive"):
    """Return an A7 at z = 300 with bx 180, c 150 and one point P on both pictures."""
    photographs = {
        "L": photograph("L", left or {"P": (30.0, 20.0)}, polarity=polarity),
        "R": photograph("R", right or {"P": (-60.0, 20.0)}, polarity=polarity),
    }
    a7 = Autograph(A7, condition, photographs)
    a7.load(1, "L")
    a7.load(2, "R")
    a7.set_element("bx", 180.0)
    a7.fittings = REQUIRED_FITTINGS[polarity, "inside"]
    return a7


# --- spindles and counters -----------------------------------------------------------------------------


@given(st.lists(st.floats(-49.0, 49.0), min_size=1, max_size=20), st.floats(0.0, 0.2))
def test_a_shaft_lags_behind_its_drum_by_at_most_half_the_play(turns, play):
    spindle = Spindle.of(Element(-50.0, 50.0, 0.0, "mm"), play, 0.0, 0.0)
    rng = np.random.default_rng(0)
    for turn in turns:
        before = spindle.position
        spindle.turn_to(turn, rng)
        assert abs(spindle.position - turn) <= play / 2.0 + 1e-12
        assert min(before, turn) - play / 2.0 - 1e-12 <= spindle.position <= max(before, turn) + play / 2.0 + 1e-12


def test_approach_from_one_side_removes_backlash():
    spindle = Spindle.of(Element(-50.0, 50.0, 0.0, "mm"), 0.04, 0.0, 0.0)
    rng = np.random.default_rng(0)
    reached = []
    for start in (-10.0, 10.0, -3.0):
        for target in (start, 1.0) if start < 1.0 else (start, -5.0, 1.0):
            spindle.turn_to(target, rng)
        reached.append(spindle.position)
    assert reached == pytest.approx([reached[0]] * 3)
    spindle.turn_to(10.0, rng)
    spindle.turn_to(1.0, rng)
    assert spindle.position - reached[0] == pytest.approx(0.04)


def test_a_setting_error_is_hidden_from_the_counter():
    spindle = Spindle.of(Element(70.0, 130.0, 100.0, "gon"), 0.0, 0.003, 0.0)
    spindle.turn_to(101.0, np.random.default_rng(3))
    assert spindle.shown == 101.0
    assert 0.0 < abs(spindle.position - 101.0) < 0.02


def test_kappa_is_endless():
    a7 = Autograph(A7)
    a7.set_element("kappa1", 399.99)
    a7.set_element("kappa1", 0.02)
    assert a7.element("kappa1") == 0.02
    assert a7.pose(1)[1] == pytest.approx(rotation(0.0, 0.0, 0.02 * GON))


def test_a_gear_changes_the_counters_step_not_its_reading():
    counter = Counter()
    counter.preset(5000.0, -325.0)
    counter.engage(8.0, 2, -325.0)
    assert counter.reading(-325.0) == 5000.0
    assert counter.reading(-324.0) == 5008.0
    assert counter.position(5008.0) == pytest.approx(-324.0)


def test_an_element_cannot_be_set_beyond_its_range_and_does_not_move():
    a7 = Autograph(A7)
    for name, element in A7.elements.items():
        for value in (element.low - 0.01, element.high + 0.01):
            before = a7.element(name)
            with pytest.raises(OutOfRangeError):
                a7.set_element(name, value)
            assert a7.element(name) == before


def test_setting_an_element_that_a_variant_lacks_is_a_conflict():
    """As for the A8: the table of the variant decides which settings are refused, not its name."""
    without_by = dataclasses.replace(
        A7, name="A8", elements={n: e for n, e in A7.elements.items() if not n.startswith("b") or n == "bx"}
    )
    plotter_without_by = Autograph(without_by)
    with pytest.raises(SettingsConflictError):
        plotter_without_by.set_element("by1", 1.0)
    assert plotter_without_by.pose(2)[0] == pytest.approx([0.0, 0.0, 0.0])


# --- rods ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("base", ["inside", "outside"])
def test_the_base_defines_the_places_of_the_centres(base):
    a7 = Autograph(A7)
    for name, value in (("bx", 200.0), ("by1", 3.0), ("by2", -4.0), ("bz1", 5.0), ("bz2", -6.0)):
        a7.set_element(name, value)
    a7.set_base_mode(base)
    x1, x2 = (0.0, 200.0) if base == "inside" else (200.0, 0.0)
    assert a7.pose(1)[0] == pytest.approx([x1, -3.0, 5.0])
    assert a7.pose(2)[0] == pytest.approx([x2, 4.0, -6.0])


@given(st.floats(-1e6, 1e6), st.floats(-500.0, 500.0), st.floats(0.01, 100.0), st.sampled_from([0, 1, 2]))
@example(0.0, -0.001, 1.0, 2)
def test_the_figures_of_a_counter_equal_its_reading_and_are_never_minus_zero(offset, position, units_per_mm, decimals):
    counter = Counter(units_per_mm, decimals, offset)
    assert counter.text(position) == f"{counter.reading(position):.{decimals}f}"


@given(
    st.floats(95.0, 105.0),
    st.floats(95.0, 105.0),
    st.floats(0.0, 400.0),
    st.floats(-60.0, 60.0),
    st.floats(-60.0, 60.0),
)
def test_the_rod_moves_the_mark_to_the_image_of_its_point(omega, phi, kappa, x, y):
    a7 = plotter()
    for name, value in (("omega1", omega), ("phi1", phi), ("kappa1", kappa), ("by1", 2.0), ("bz1", -3.0)):
        a7.set_element(name, value)
    a7.drive("X", x)
    a7.drive("Y", y)
    centre, turned = a7.pose(1)
    ray = ray_of(a7.mark_on_carrier(1), turned, 150.0)
    np.testing.assert_allclose(at_level(centre, ray, -300.0), [round(x, 2), round(y, 2), -300.0], atol=1e-9)


def test_both_images_are_at_the_mark_where_the_rays_meet():
    a7 = plotter()
    a7.drive("X", 60.0)
    a7.drive("Y", 40.0)
    assert a7.eyepiece(1, "P") == pytest.approx((0.0, 0.0), abs=1e-6)
    assert a7.eyepiece(2, "P") == pytest.approx((0.0, 0.0), abs=1e-6)


def test_by_reads_the_parallax_with_the_signs_of_the_law():
    """p = y1 - y2; by' clears it reading +p, by" reading -p (geometry.md)."""
    a7 = plotter(left={"P": (30.0, 20.5)})
    a7.drive("X", 60.0)
    a7.drive("Y", 40.0)
    p = 0.5 * 300.0 / 150.0
    assert a7.stereo("P") == pytest.approx((0.0, 500.0))
    a7.set_element("by1", p)
    assert a7.stereo("P")[1] == pytest.approx(0.0, abs=1e-6)
    a7.set_element("by1", 0.0)
    a7.set_element("by2", -p)
    assert a7.stereo("P")[1] == pytest.approx(0.0, abs=1e-6)


def test_a_point_beyond_the_field_of_view_is_not_seen():
    a7 = plotter()
    a7.drive("X", 60.0 + 2.0 * 9.9)
    a7.drive("Y", 40.0)
    assert a7.eyepiece(1, "P") is not None
    a7.turn_handwheel("X", 0.5)
    assert a7.eyepiece(1, "P") is None
    assert a7.stereo("P") is None
    assert a7.eyepiece(1, "unknown") is None


# --- fittings ------------------------------------------------------------------------------------------


def seen_off_the_mark(polarity="positive", **fittings):
    a7 = plotter(polarity=polarity)
    for name, position in fittings.items():
        a7.set_fitting(name, position)
    a7.drive("X", 58.0)
    a7.drive("Y", 38.0)
    return a7.eyepiece(1, "P")


def test_the_right_fittings_show_the_picture_as_it_is():
    assert seen_off_the_mark() == pytest.approx((1000.0, 1000.0))
    assert seen_off_the_mark("negative") == pytest.approx((1000.0, 1000.0))


def test_a_wrong_dove_index_mirrors_the_picture_top_to_bottom():
    assert seen_off_the_mark(dove="inside") == pytest.approx((1000.0, -1000.0))


def test_a_wrong_diapositive_lever_mirrors_it_left_to_right():
    assert seen_off_the_mark(diapositive="right") == pytest.approx((-1000.0, 1000.0))


def test_the_triangulation_lever_exchanges_the_eyes_and_inverts_the_relief():
    a7 = plotter(left={"P": (31.0, 20.0)})
    a7.drive("X", 60.0)
    a7.drive("Y", 40.0)
    right_way = a7.stereo("P")
    left_picture = a7.eyepiece(1, "P")
    a7.set_fitting("triangulation", "front")
    assert a7.eyepiece(2, "P") == left_picture
    assert a7.stereo("P")[0] == pytest.approx(-right_way[0])


@pytest.mark.parametrize("polarity", ["positive", "negative"])
@pytest.mark.parametrize("axis", ["X", "Y"])
def test_a_collar_that_does_not_belong_to_the_picture_reverses_its_wheel(polarity, axis):
    a7 = plotter(polarity=polarity)
    a7.turn_handwheel(axis, 1.0)
    assert a7.counter(axis) == 1.0
    now = a7.fittings.as_words()[f"{axis.lower()}collar"]
    a7.set_fitting(f"{axis.lower()}collar", "out" if now == "in" else "in")
    a7.turn_handwheel(axis, 1.0)
    assert a7.counter(axis) == 0.0


@pytest.mark.parametrize("polarity", ["positive", "negative"])
def test_with_base_out_and_its_fittings_the_left_eye_sees_the_left_hand_photograph_unturned(polarity):
    a7 = plotter(left={"P": (-60.0, 20.0)}, right={"P": (30.0, 20.0)}, polarity=polarity)
    a7.set_base_mode("outside")
    a7.fittings = REQUIRED_FITTINGS[polarity, "outside"]
    a7.drive("X", 58.0)
    a7.drive("Y", 38.0)
    assert a7.eyepiece(1, "P") == pytest.approx((1000.0, 1000.0))
    a7.drive("X", 60.0)
    a7.drive("Y", 40.0)
    assert a7.stereo("P") == pytest.approx((0.0, 0.0), abs=1e-6)


def test_a_drum_turned_by_hand_stops_between_two_counts_and_its_counter_rounds():
    """geometry.md: a spindle has a continuous position; only a setting through the counter lands on a count."""
    a7 = plotter()
    a7.drive("X", 60.0)
    a7.drive("Y", 40.0)
    before = a7.stereo("P")[1]
    for _ in range(2):
        a7.turn_element("by1", 0.004)
    assert a7.element("by1") == 0.01
    assert a7.stereo("P")[1] - before == pytest.approx(-1e3 * 0.008 * 150.0 / 300.0)
    a7.set_element("by1", 0.0)
    assert a7.stereo("P")[1] == pytest.approx(before)


def test_only_a_setting_through_the_counter_draws_a_new_setting_error():
    a7 = plotter(condition=Condition(setting_sigma_mm=0.01))
    a7.drive("X", 60.0)
    a7.drive("Y", 40.0)
    a7.set_element("by1", 1.0)
    stands = a7.stereo("P")[1]
    a7.turn_element("by1", 0.5)
    a7.turn_element("by1", -0.5)
    assert a7.stereo("P")[1] == pytest.approx(stands, abs=1e-9)
    a7.set_element("by1", 1.0)
    assert a7.stereo("P")[1] != pytest.approx(stands, abs=1e-3)


def test_a_swing_is_turned_through_its_zero_and_a_tilt_not_beyond_its_end():
    a7 = plotter()
    a7.turn_element("kappa1", -0.25)
    assert a7.element("kappa1") == 399.75
    with pytest.raises(OutOfRangeError):
        a7.turn_element("phi1", 6.5)
    assert a7.element("phi1") == 100.0


def test_a_swung_picture_appears_swung():
    a7 = plotter()
    a7.set_element("kappa1", 100.0)
    centre = a7.carrier(1)
    centre.centre(-30.0 + 1.0, -20.0, 0.0)
    assert a7.eyepiece(1, "P") == pytest.approx((0.0, 1000.0), abs=1e-9)


# --- condition -----------------------------------------------------------------------------------------


def test_faults_shift_the_view_and_not_the_counters():
    faultless, worn = (
        plotter(),
        plotter(
            condition=Condition(
                left=ProjectorCondition(principal_distance_mm=0.02, principal_point_um=(10.0, -5.0), phi_zero_gon=0.01)
            )
        ),
    )
    for a7 in (faultless, worn):
        a7.drive("X", 60.0)
        a7.drive("Y", 40.0)
    assert worn.element("phi1") == faultless.element("phi1") == 100.0
    assert worn.counter("X") == faultless.counter("X")
    assert worn.eyepiece(1, "P") != pytest.approx(faultless.eyepiece(1, "P"), abs=1.0)
    assert worn.eyepiece(2, "P") == faultless.eyepiece(2, "P")


def test_eccentric_axes_move_the_centre_when_the_camera_tilts():
    condition = Condition(left=ProjectorCondition(axes_um=(0.0, 0.0, 5.0)))
    a7 = plotter(condition=condition)
    assert a7.pose(1)[0] == pytest.approx([0.0, 0.0, 0.0])
    a7.set_element("phi1", 105.0)
    assert a7.pose(1)[0][0] == pytest.approx(0.005 * np.sin(5.0 * GON))


def test_readings_at_is_the_inverse_of_the_guides():
    condition = Condition(carriage_scale_ppm=(100.0, -50.0, 30.0), carriage_skew_ppm=(20.0, 10.0, -15.0))
    a7 = Autograph(A7, condition)
    a7.drive("X", 120.0)
    a7.drive("Y", -80.0)
    found = a7.readings_at(a7.mark_in_model())
    assert found == pytest.approx({"X": 120.0, "Y": -80.0, "Z": -300.0})


# --- pictures ------------------------------------------------------------------------------------------


def test_the_eyepiece_picture_shows_the_signal_at_the_place_that_the_eyepiece_reads():
    scene = build_scene(load_scenario("akwanga"), 1)
    with_picture = build_autograph(load_scenario("akwanga").instrument, scene.photographs, 1)
    with_picture.load(1, "101")
    point = scene.photographs["101"].points.get("K1")
    with_picture.drive("X", float(point[0]) * 2.0)
    with_picture.drive("Y", float(point[1]) * 2.0)
    dx, dy = with_picture.eyepiece(1, "K1")
    columns = rows = 401
    frame = with_picture.picture(1, columns, rows, 10.0)
    pitch = 2000.0 / (columns)
    i, j = round((rows - 1) / 2 - dy / pitch), round((columns - 1) / 2 + dx / pitch)
    arm = round(70.0 / pitch)
    white = 0.99 * float(fall_off(scene.photographs["101"].camera, point))
    assert min(frame[i, j + arm], frame[i, j - arm], frame[i + arm, j], frame[i - arm, j]) > white - GRAIN
    assert frame[200, 200] == 1.0
    assert 0.2 < frame.mean() < 0.8


def test_both_photographs_show_the_same_ground():
    """A picture is evaluated at the intersection of each ray with the ground, so both agree in true perspective."""
    scenario = load_scenario("akwanga", {"film.irregular_um": "0", "film.identification_um": "0"})
    scene = build_scene(scenario, 1)
    for name in ("K1", "1021", "C3"):
        seen = [scene.photographs[photo].points.get(name) for photo in ("101", "102")]
        around = np.array([[0.5, -0.4, 0.3], [0.2, 0.6, -0.7]])
        left, right = (
            scene.photographs[photo].content(place[:, None] + around, 0.02)
            for photo, place in zip(("101", "102"), seen, strict=True)
        )
        unlike = scene.photographs["102"].content(seen[1][:, None] + around + 5.0, 0.02)
        assert np.abs(left - right).max() < np.abs(left - unlike).max()


def test_a_picture_upside_down_has_its_fiducials_far_from_their_marks():
    a7 = Autograph(A7, photographs={"L": photograph("L", {"P": (30.0, 20.0)}, placement="upside down")})
    a7.load(1, "L")
    assert min(np.hypot(dx, dy) for _, dx, dy in a7.carrier(1).fiducial_displacements()) > 200.0


def test_the_same_photograph_cannot_be_in_two_projectors():
    a7 = plotter()
    with pytest.raises(SettingsConflictError):
        a7.load(2, "L")


def test_every_variant_is_complete():
    for variant in VARIANTS.values():
        for element in variant.elements.values():
            assert element.low <= element.zero <= element.high
        assert set(variant.carriages) == set(variant.carriages_at_rest) == set(variant.scales) == {"X", "Y", "Z"}
        for axis, (low, high) in variant.carriages.items():
            assert low <= variant.carriages_at_rest[axis] <= high
        assert set(variant.fittings) <= set(POSITIONS_OF)
        assert variant.centres_on_base[1] - variant.centres_on_base[0] == 1.0


@given(st.floats(0.3, 9.0), st.floats(-9000.0, 9000.0), st.sampled_from("XYZ"), st.integers(0, 1))
def test_a_carriage_can_be_driven_to_the_readings_of_its_ends(units, preset, axis, end):
    a7 = Autograph(A7)
    a7.drive("Z", -490.0)
    a7.set_height_gear(units)
    a7.preset(axis, preset)
    a7.drive(axis, a7.counter_limits(axis)[end])
    assert a7.counter(axis) == a7.counter_limits(axis)[end]


def test_rods_that_a_reset_left_too_steep_can_move_back_but_not_further():
    a7 = Autograph(A7)
    for name, value in (("bz1", 27.0), ("bz2", 27.0), ("by1", 50.0), ("by2", 50.0)):
        a7.set_element(name, value)
    a7.drive("Z", -140.0)
    a7.drive("Y", -250.0)
    a7.reset()
    with pytest.raises(OutOfRangeError):
        a7.drive("Y", -251.0)
    a7.drive("Y", -240.0)
    a7.drive("Y", 0.0)
    a7.turn_handwheel("X", 1.0)


def test_a_registration_is_struck_out_once_and_keeps_its_reason():
    a7 = Autograph(A7)
    a7.recorder.register("1", [("X", "0.00")])
    a7.recorder.strike(1, "wrong point")
    with pytest.raises(SettingsConflictError):
        a7.recorder.strike(1, "another reason")
    assert a7.recorder.registrations[0].struck == "wrong point"
