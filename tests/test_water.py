"""Standard points under water cannot be pricked, and every procedure continues with the other points."""

import json
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from a7sim.operator import OperatorGaveUp, measure_models
from a7sim.operator.driving.scpi_driver import ScpiDriver
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.mapping.compilation import Compilation
from a7sim.operator.mapping.level_model import level_model
from a7sim.operator.mapping.map_lines import Area, Tracing
from a7sim.operator.mapping.stereo_view import StereoView
from a7sim.operator.people.operator_batch import OperatorBatch
from a7sim.operator.procedures.models import measure_models_batch
from a7sim.scenario import load_scenario
from a7sim.scenario.schema import Water
from a7sim.scene import build_scene
from a7sim.scene.content import WATER_TONE
from a7sim.session import open_session
from a7sim.session.session_batch import open_batch
from a7sim.standard_points import CASES, determine_orientation
from a7sim.strip_methods.strip import ground_control
from tests.support.sessions import read_once, without_errors
from tests.test_session_batch import same_to_the_digit

LAKE = "akwanga-lake"

SHORES = {
    "1": [(440650.0, 984950.0), (440800.0, 984950.0), (440800.0, 985060.0), (440650.0, 985060.0)],
    "3 and 4": [(439900.0, 984100.0), (441000.0, 984100.0), (441000.0, 984400.0), (439900.0, 984400.0)],
    "1 and 5": [(440650.0, 984950.0), (440900.0, 984950.0), (440900.0, 985900.0), (440650.0, 985900.0)],
}
"""Shores by the points 1 to 6 of Akwanga's first model that they put under water."""


def flooded(name, **overrides):
    """Return Akwanga's first model with a lake, every parallax read once."""
    scenario = read_once(load_scenario("akwanga", overrides))
    terrain = msgspec.structs.replace(scenario.terrain, water=[Water(shore=SHORES[name])])
    return msgspec.structs.replace(scenario, terrain=terrain, models=scenario.models[:1])


def measure_first_model(scenario, seed=1):
    session = open_session(scenario, seed)
    return next(iter(measure_models(session.person, session.job))), session.person


# --- the scene ------------------------------------------------------------------------------------------


def test_no_point_in_the_water_is_pricked_and_all_others_are_unchanged():
    wet, dry = (build_scene(load_scenario(name), 7) for name in (LAKE, "akwanga"))
    assert set(dry.standard_points["1"]) - set(wet.standard_points["1"]) == {"6"}
    assert set(dry.standard_points["2"]) - set(wet.standard_points["2"]) == {"5"}
    for name, photograph in dry.photographs.items():
        for marks, without in ((photograph.points, wet.photographs[name].points),):
            assert set(marks.names) - set(without.names) == {"1025"} & set(marks.names)
            for point in without.names:
                np.testing.assert_array_equal(marks.get(point), without.get(point))


def test_a_flooded_signal_is_not_visible():
    scenario = load_scenario(LAKE)
    c3 = next(point for point in scenario.ground if point.point == "C3")
    around = [(c3.X + east, c3.Y + north) for east, north in ((-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0))]
    terrain = msgspec.structs.replace(scenario.terrain, water=[Water(shore=around)])
    photographs = build_scene(msgspec.structs.replace(scenario, terrain=terrain), 7).photographs
    assert all(photograph.points.get("C3") is None for photograph in photographs.values())
    assert photographs["102"].points.get("1025") is not None


def test_the_picture_of_water_shows_only_grain_and_that_of_land_is_unchanged():
    wet, dry = (build_scene(load_scenario(name), 7) for name in (LAKE, "akwanga"))
    middle = dry.photographs["102"].points.get("1025")
    around = np.stack(np.meshgrid(np.linspace(-1.0, 1.0, 21), np.linspace(-1.0, 1.0, 21))) + middle[:, None, None]
    water, land = (each.photographs["102"].content(around, 0.1) for each in (wet, dry))
    assert water.std() < 0.01
    assert 0.7 * WATER_TONE < water.mean() < WATER_TONE
    assert land.std() > 0.05
    elsewhere = around - 40.0 * np.sign(middle)[:, None, None]
    np.testing.assert_array_equal(
        wet.photographs["102"].content(elsewhere, 0.1), dry.photographs["102"].content(elsewhere, 0.1)
    )


def test_a_bay_of_the_lake_is_land():
    """The shore is a horseshoe: the land between its arms is dry, both arms are wet."""
    horseshoe = [
        (0.0, 0.0),
        (30.0, 0.0),
        (30.0, 30.0),
        (20.0, 30.0),
        (20.0, 10.0),
        (10.0, 10.0),
        (10.0, 30.0),
        (0.0, 30.0),
    ]
    scenario = load_scenario("akwanga")
    ground = build_scene(
        msgspec.structs.replace(
            scenario, terrain=msgspec.structs.replace(scenario.terrain, water=[Water(shore=horseshoe)])
        ),
        1,
    ).ground
    wet = ground.under_water(np.array([[5.0, 15.0, 25.0, 15.0, 35.0, -5.0], [20.0, 20.0, 20.0, 5.0, 5.0, 5.0]]))
    assert wet.tolist() == [True, False, True, True, False, False]


@pytest.mark.parametrize(
    ("positions", "determined"),
    [
        *(("12345", True), ("123456", True), ("23456", True), ("13456", True), ("abcdef", True)),
        *(("1234", False), ("1246", False), ("12def", False), ("1abc", False), ("", False)),
    ],
)
def test_five_elements_require_three_rows_and_two_points_in_two_of_them(positions, determined):
    assert determine_orientation(positions) is determined


# --- the operator ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("procedure", ["numerical", "empirical"])
def test_a_strip_with_a_corner_under_water_is_completed_over_the_link(procedure, finished):
    out, result = finished("akwanga-lake empirical" if procedure == "empirical" else "akwanga-lake", 7)
    document = json.loads((out / "results.json").read_text())
    assert document["status"] == "complete"
    for model, absent, tie in zip(document["models"], "65", ("C3", "C4"), strict=True):
        assert absent not in model["standard_points"]
        assert absent not in model["relative_orientation"]["residual_parallax_mm"]
        assert len(model["relative_orientation"]["residual_parallax_mm"]) == 14
        assert model["truth"]["rotation_difference_gon"] < 0.05
        assert {"1021", "1023", tie} <= set(model["points"])
        assert all(abs(off["Z0"]) < 10.0 for off in model["truth"]["centre_differences"].values())
    assert "1025" not in json.dumps(document)
    assert ",1025," not in (out / "book.csv").read_text()
    assert document["operator"]["remarks"][0] == "1: not pricked on both prints, done without: 6"
    assert document["strip"]["accuracy_m"]["checks"]["height"] < 0.4
    (bottom,) = [line for line in result.stdout.splitlines() if line.startswith(" " * 10 + "c ")]
    assert bottom.split()[0::2] == ["c", "f", "i", "6"]


@pytest.mark.parametrize("procedure", ["numerical", "empirical"])
def test_a_batch_omits_the_same_points(procedure):
    scenario = read_once(load_scenario(LAKE, {"plan.procedure": f'"{procedure}"'}))
    assert same_to_the_digit(msgspec.structs.replace(scenario, models=scenario.models[:1]), (2, 3), all_finish=True)


@pytest.mark.parametrize("procedure", ["numerical", "empirical"])
def test_a_point_on_the_prints_of_some_sessions_of_a_batch_is_used_by_these(procedure):
    """At 101.25 mm point 5 is on the edge of the picture: only a film with enough shrinkage shows it."""
    scenario = read_once(
        load_scenario(
            "akwanga",
            {"plan.half_width": "101.25", "film.shrinkage_sigma_ppm": "1000", "plan.procedure": f'"{procedure}"'},
        )
    )
    scenario = msgspec.structs.replace(scenario, models=scenario.models[:1])
    shown = [
        all(scene.photographs[name].points.get("1015") is not None for name in ("101", "102"))
        for scene in open_batch(scenario, (2, 3)).scenes
    ]
    assert shown == [False, True]
    assert same_to_the_digit(scenario, (2, 3), all_finish=True)


def test_with_point_1_under_water_the_counters_are_preset_at_another_point_named_in_the_book():
    record, person = measure_first_model(flooded("1"))
    assert set(record.orientation.residuals) == set(CASES["E"]) - {"1"}
    assert record.points["1021"] == pytest.approx((5000.0, 5000.0, 5000.0), abs=15.0)
    assert "1: there is no point 1: counters preset at 1021, point 2" in person.book.remarks
    assert record.orientation.rms < 0.03


@pytest.mark.parametrize(
    ("shore", "overrides", "sentence"),
    [
        (
            "1",
            {"plan.procedure": '"empirical"'},
            "1: 1 of the standard points cannot be used: there must be two points",
        ),
        (
            "3 and 4",
            {},
            "1: of the points of case A only 1, 2, 5, 6 can be used: there must be one in each of the three",
        ),
        (
            "1 and 5",
            {},
            "1: of the points of case A only 2, 3, 4, 6 can be used: there must be one in each of the three",
        ),
    ],
)
def test_the_error_message_for_too_few_points_is_one_sentence(shore, overrides, sentence):
    with pytest.raises(OperatorGaveUp) as raised:
        measure_first_model(flooded(shore, **overrides))
    assert str(raised.value).startswith(sentence)


def test_with_all_points_under_water_the_operator_gives_up():
    scenario = flooded("1")
    everywhere = [(4e5, 9e5), (5e5, 9e5), (5e5, 1.1e6), (4e5, 1.1e6)]
    terrain = msgspec.structs.replace(scenario.terrain, water=[Water(shore=everywhere)])
    with pytest.raises(OperatorGaveUp, match="1: no point is pricked on both the prints of 101 and 102"):
        measure_first_model(msgspec.structs.replace(scenario, terrain=terrain))


def test_the_points_in_between_determine_a_model_without_corners():
    record, _ = measure_first_model(flooded("1 and 5", **{"plan.case": '"E"'}))
    assert set(record.orientation.rounds[0].parallaxes) == set(CASES["E"]) - {"1", "5"}
    assert record.orientation.rms < 0.03


def test_a_closed_form_without_one_of_its_points_is_replaced_by_least_squares():
    scenario = read_once(load_scenario(LAKE, {"plan.solution": '"hallert"'}))
    record, person = measure_first_model(scenario)
    assert "1: no closed form for the points 1 2 3 4 5, so by least squares" in person.book.remarks
    assert record.orientation.rms < 0.03


# --- compilation ----------------------------------------------------------------------------------------


def test_a_model_without_a_corner_has_the_border_of_the_other_points():
    places = {"P3": (0.0, 9.0, 0.0), "P4": (8.0, 10.0, 0.0), "P5": (1.0, -7.0, 0.0), "P6": (7.0, -9.0, 0.0)}
    points = {label: f"P{label}" for label in "3456"}
    every, without = Area.within(points, places), Area.within({**points, "6": "not there"}, places)
    assert (*every.low, *every.high) == (1.0, -7.0, 7.0, 9.0)
    assert (*without.low, *without.high) == (1.0, -7.0, 8.0, 9.0)


SPACING = 4.0
"""Spacing of spot heights, mm in the model."""


@pytest.mark.slow
def test_on_water_no_spot_is_set_and_no_contour_is_traced():
    """Contours end within 4 m of the shore, half of the smallest patch of a match; spots are on land."""
    scenario = without_errors(load_scenario(LAKE))
    session = open_session(scenario, 1)
    person = session.person
    person.book.set_heading("", "preparation")
    workstation = Workstation(
        OperatorBatch.single(person), ScpiDriver(person), replace(session.job, models=session.job.models[:1])
    )
    record = next(measure_models_batch(workstation)).for_session(0)
    view = StereoView(workstation, person)
    model = level_model(workstation, view, record.points, ground_control(scenario, session.scene), 3750.0)
    ground = session.scene.ground
    shore = np.array([*ground.shores[0][:, 2], 460.0])
    x, y, _ = model.readings_of(shore)
    area = Area(np.array([x - 9.0, y - 6.0]), np.array([x + 9.0, y + 6.0]))
    work = Compilation(workstation, person, view, model, area, Tracing(0.0))
    spots = work.spot_heights(SPACING)

    def on_ground(plan):
        return model.on_ground(np.concatenate([plan, np.full((1, *plan.shape[1:]), np.nanmean(spots.readings[2]))]))[:2]

    plan = np.array(np.meshgrid(*area.grid(SPACING), indexing="ij"))
    wet = ground.under_water(on_ground(plan))
    away = 4.0 * np.array([[np.cos(t), np.sin(t)] for t in np.linspace(0.0, 6.0, 12)])
    around = [plan + shift[:, None, None] for shift in away]
    inland = np.all([ground.under_water(on_ground(each)) == wet for each in around], axis=0)
    assert wet[inland].any() and (~wet[inland]).any()
    assert np.isnan(spots.heights)[inland & wet].all()
    assert np.isnan(spots.heights)[inland & ~wet].mean() < 0.25
    on_land = spots.heights[inland & ~wet]
    low, high = np.nanmin(on_land), np.nanmax(on_land)
    lines = [line for height in np.linspace(low, high, 5)[1:-1] for line in work.contour(float(height), spots)]
    assert any("lost" in line.endings for line in lines)
    followed = model.on_ground(np.concatenate([line.readings for line in lines], axis=1))[:2]
    off_shore = np.all([ground.under_water(followed + shift[:, None]) for shift in away], axis=0)
    assert not off_shore.any()
