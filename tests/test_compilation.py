"""Compilation: contours and roads followed with the mark, the sheet they make, and the truth beside them."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from a7sim.errors import A7SimError
from a7sim.operator.driving.scpi_driver import ScpiDriver
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.mapping.compilation import Compilation
from a7sim.operator.mapping.level_model import level_model
from a7sim.operator.mapping.map_lines import Area, LineTarget, SpotHeights, Tracing, as_polyline
from a7sim.operator.mapping.plotting import CompiledMap, MapRequest, _heights
from a7sim.operator.mapping.stereo_view import FINE_MM, StereoView
from a7sim.operator.people.operator_batch import OperatorBatch
from a7sim.operator.procedures.models import measure_models_batch
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene
from a7sim.session import open_session
from a7sim.session.compiling import CompilationRequest, compile_model
from a7sim.session.map_svg import index_contours, to_geojson, to_svg
from a7sim.strip_methods.strip import given_control, ground_control
from tests.support.sessions import without_errors
from tests.test_cli import a7sim

SCALE = 3750.0
UNIT_M = SCALE / 8.0 / 1000.0
"""A unit of the Z counter on the ground."""


class Worker:
    """An operator without error at a level model of Akwanga, and what was said over the line."""

    def __init__(self):
        scenario = without_errors(load_scenario("akwanga"))
        self.lines = []
        self.session = open_session(scenario, 1, self.lines.append)
        job = replace(self.session.job, models=self.session.job.models[:1])
        person = self.session.person
        person.book.set_heading("", "preparation")
        self.workstation = Workstation(OperatorBatch.single(person), ScpiDriver(person), job)
        self.record = next(measure_models_batch(self.workstation)).for_session(0)
        self.view = StereoView(self.workstation, person)
        control = ground_control(scenario, self.session.scene)
        self.model = level_model(self.workstation, self.view, self.record.points, control, SCALE)
        self.area = Area(np.array([5030.0, 4990.0]), np.array([5110.0, 5070.0]))
        self.spots = self.at_work(0.0).spot_heights(20.0)

    def at_work(self, tremor_um):
        return Compilation(self.workstation, self.session.person, self.view, self.model, self.area, Tracing(tremor_um))

    def too_high(self, readings, height=None):
        """Heights as drawn minus the true ground, m."""
        east, north, up = self.model.on_ground(readings)
        return (up if height is None else height) - self.session.scene.ground.height(east, north)

    def sheet(self, lines, heights):
        return CompiledMap(
            self.record, self.model, self.area, self.spots, tuple(lines), heights, 1.5, 1220.0, 0.05, 0.1
        )  # fmt: skip


@pytest.fixture(scope="module")
def worker():
    return Worker()


@pytest.fixture(scope="module")
def contour(worker):
    height = float(np.round(np.mean(worker.spots.range)))
    return height, worker.at_work(0.0).contour(height, worker.spots)


def test_the_model_is_level_and_to_scale(worker):
    assert worker.model.tilt_gon < 0.02
    assert 1e3 * worker.model.metres_per_mm == pytest.approx(SCALE, rel=2e-4)


def test_the_eyes_see_height_and_slope_of_the_ground(worker):
    worker.at_work(0.0)._drive(np.array([5070.0, 5030.0]), float(np.nanmean(worker.spots.readings[2])))
    active = np.zeros(1, dtype=int)

    def true_height(dx, dy):
        at = worker.workstation.controls.counters(active)[:, 0] + (dx, dy, 0.0)
        return -float(worker.too_high(at[:, None])[0]) / worker.model.metres_per_mm

    look = worker.view.look(FINE_MM)
    surface = worker.view.surface(look, reach=8.0)
    slope = [true_height(1, 0) - true_height(-1, 0), true_height(0, 1) - true_height(0, -1)]
    assert surface.fused
    assert surface.height == pytest.approx(true_height(0, 0), abs=0.02)
    assert surface.slope == pytest.approx(np.array(slope) / 2.0, abs=0.01)


def test_spot_heights_without_error_stand_on_the_ground(worker):
    errors = worker.too_high(worker.spots.readings.reshape(3, -1))
    assert np.abs(errors).max() < 0.25 * UNIT_M


def test_a_contour_without_error_lies_on_the_ground_within_a_quarter_of_a_counter_unit(worker, contour):
    height, lines = contour
    assert lines
    errors = np.concatenate([worker.too_high(line.readings, height) for line in lines])
    assert errors.size > 20
    assert np.sqrt((errors**2).mean()) < 0.1 * UNIT_M
    assert np.abs(errors).max() < 0.25 * UNIT_M


def test_a_contour_keeps_its_z_and_ends_at_the_edge_or_where_it_began(worker, contour):
    _, lines = contour
    for line in lines:
        assert np.ptp(line.readings[2]) <= 0.011
        assert line.closed or "lost" not in line.endings
        if line.closed:
            assert (line.readings[:, 0] == line.readings[:, -1]).all()
        else:
            for end in line.readings[:2, [0, -1]].T:
                assert min(*np.abs(end - worker.area.low), *np.abs(worker.area.high - end)) < 0.05


def test_tremor_grows_the_errors_as_it_is_set(worker, contour):
    height, _ = contour
    tremor_um = 60.0
    shaken = worker.at_work(tremor_um).contour(height, worker.spots)
    readings = np.concatenate([line.readings for line in shaken], axis=1)
    errors = worker.too_high(readings, height)
    east, north, _ = worker.model.on_ground(readings)
    ground = worker.session.scene.ground
    here = ground.height(east, north)
    slope = np.hypot(ground.height(east + 1.0, north) - here, ground.height(east, north + 1.0) - here)
    plan = 1e-6 * tremor_um * 8000.0
    assert np.sqrt((errors**2).mean()) == pytest.approx(np.sqrt((slope**2).mean()) * plan, rel=0.35)


def test_a_road_is_followed_by_its_middle(worker):
    work = worker.at_work(0.0)
    east, north = worker.session.scene.lines["road1"].middle
    readings = worker.model.readings_of(np.array([east, north, np.full(east.size, 455.0)]))
    within = [i for i in range(east.size) if worker.area.contains(readings[:2, i])]
    start, towards, end = ((east[i], north[i]) for i in (within[2], within[4], within[-1]))
    line = work.line(LineTarget("road1", "road", start, towards, end), worker.spots)
    at = worker.model.on_ground(line.readings)
    off = [float(worker.session.scene.lines["road1"].distance(place[:, None])[0]) for place in at[:2].T]
    assert len(off) > 5
    assert np.sqrt(np.mean(np.square(off))) < 0.4
    assert np.sqrt((worker.too_high(line.readings) ** 2).mean()) < UNIT_M


def test_vertices_are_registered_and_the_truth_does_not_cross_the_line(worker, contour):
    height, _ = contour
    before = len(worker.lines)
    worker.at_work(0.0).contour(height, worker.spots)
    crossed = worker.lines[before:]
    assert any(f'REC "contour {height:g}"' in event.text for event in crossed)
    said = {
        unit.split(" ")[0].lstrip(":") for event in crossed if event.direction == "in" for unit in event.text.split(";")
    }
    assert said <= {
        "COUN?",
        "DRIV:X",
        "Y",
        "Z",
        "WHE:X",
        "REC",
        "REC:LAST?",
        "EYEP1:PICT?",
        "EYEP2:PICT?",
        "SYST:ERR?",
    } | {"SYST:ERR:COUN?"}


def test_geojson_and_svg_can_be_read_and_close(worker, contour):
    height, lines = contour
    sheet = worker.sheet(lines, (height,))
    found = json.loads(to_geojson(sheet))
    drawn = [each for each in found["features"] if each["properties"]["kind"] == "contour"]
    assert len(drawn) == len(lines)
    for each in drawn:
        assert each["properties"] | {"height": height, "model": "1", "scale": 2500} == each["properties"]
        assert {"sigma", "closed"} <= set(each["properties"])
        if each["properties"]["closed"]:
            assert each["geometry"]["coordinates"][0] == each["geometry"]["coordinates"][-1]
    root = ET.fromstring(to_svg(sheet, 'A & "B" <C>'))
    names = [each.tag.split("}")[1] for each in root]
    assert root.get("role") == "img"
    assert {"title", "desc"} <= set(names)
    assert {"contours", "lines", "control", "north", "scale-bar", "grid"} <= {each.get("id") for each in root.iter()}
    assert root.get("width") == f"{float(root.get('viewBox').split()[2]):.1f}mm"


def test_the_table_draws_at_map_scale(worker):
    places = worker.sheet([], ()).on_table(worker.spots.readings[:, [0, -1], [0, -1]])
    ground = worker.model.on_ground(worker.spots.readings[:, [0, -1], [0, -1]])
    on_table, on_ground = (np.diff(each[:2], axis=1)[:, 0] for each in (places, ground))
    assert on_table == pytest.approx(1e3 * on_ground / 2500.0, abs=0.02)


def test_index_contours_are_every_fifth_of_their_interval():
    assert index_contours((440.0, 450.0, 460.0, 470.0, 500.0)) == {450.0, 500.0}
    assert index_contours((446.0, 460.0, 463.0)) == {446.0, 460.0, 463.0}


def test_a_height_outside_the_model_is_a_mistake(worker):
    with pytest.raises(A7SimError, match=r"--contour 900: expected a height within the model"):
        _heights(MapRequest((900.0,), None, (), Tracing(0.0)), worker.spots)
    flat = SpotHeights(np.zeros((3, 1, 2)), np.array([[1.0, 2.0]]))
    with pytest.raises(A7SimError, match="at most 100 contours"):
        _heights(MapRequest((), 0.001, (), Tracing(0.0)), flat)


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        (CompilationRequest("9", (460.0,)), "--model: expected one of 1, 2"),
        (CompilationRequest("1", lines=("road9",)), "--line: expected one of road1, track1, got road9"),
        (CompilationRequest("1"), "compile: expected a --contour"),
    ],
)
def test_what_cannot_be_compiled_is_said_before_any_work(wanted, said):
    with pytest.raises(A7SimError, match=said):
        compile_model(load_scenario("akwanga"), 1, wanted)


def test_an_unknown_line_ends_with_one_sentence_and_exit_code_2():
    done = a7sim("compile", "akwanga", "--line", "road9")
    assert done.returncode == 2
    assert done.stderr == "a7sim: --line: expected one of road1, track1, got road9\n"


def test_an_operator_is_given_no_coordinate_that_a_points_role_leaves_out():
    """Plan control without a height, height control without a plan, no checks: nan, not what the terrain has there."""
    scenario = load_scenario("schut-1956")
    given = given_control(scenario, build_scene(scenario, 1))
    at = dict(zip(given.points, given.coordinates.T, strict=True))
    assert set(at) == {"P1", "P2", "H1", "H2", "H3"}
    assert np.isnan(at["P1"]).tolist() == [False, False, True]
    assert np.isnan(at["H1"]).tolist() == [True, True, False]


def test_a_contour_that_ends_where_it_begins_is_an_emptychained():
    assert as_polyline([]).shape == (3, 0)
    assert as_polyline([np.array([1.0, 2.0, 3.0])]).shape == (3, 1)


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        ("nan", "expected a finite number, got nan"),
        ("inf", "expected a finite number, got inf"),
        ("0", "expected more than 0, got 0.0"),
        ("-5", "expected more than 0, got -5.0"),
        ("ten", "expected a number, got 'ten'"),
    ],
)
def test_an_interval_that_is_no_distance_is_refused(typed, value, sentence):
    code, _, err = typed("compile", "akwanga", "--interval", value)
    assert (code, err.count("\n")) == (2, 1)
    assert err.startswith(f"a7sim: --interval: {sentence}")
