"""Compilation: contours and roads followed with the mark, the map sheet, and the comparison with the truth."""

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


class PlottingSession:
    """An operator without error at a level model of Akwanga, with the lines on the link."""

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
        self.spots = self.compilation(0.0).spot_heights(20.0)

    def compilation(self, tremor_um):
        return Compilation(self.workstation, self.session.person, self.view, self.model, self.area, Tracing(tremor_um))

    def height_errors(self, readings, height=None):
        """Return drawn heights minus the heights of the true ground, m."""
        east, north, up = self.model.on_ground(readings)
        return (up if height is None else height) - self.session.scene.ground.height(east, north)

    def sheet(self, lines, heights):
        return CompiledMap(
            self.record, self.model, self.area, self.spots, tuple(lines), heights, 1.5, 1220.0, 0.05, 0.1
        )  # fmt: skip


@pytest.fixture(scope="module")
def plotting_session():
    return PlottingSession()


@pytest.fixture(scope="module")
def contour(plotting_session):
    height = float(np.round(np.mean(plotting_session.spots.range)))
    return height, plotting_session.compilation(0.0).contour(height, plotting_session.spots)


def test_the_model_is_level_and_to_scale(plotting_session):
    assert plotting_session.model.tilt_gon < 0.02
    assert 1e3 * plotting_session.model.metres_per_mm == pytest.approx(SCALE, rel=2e-4)


def test_the_stereo_view_gives_height_and_slope_of_the_ground(plotting_session):
    plotting_session.compilation(0.0)._drive(
        np.array([5070.0, 5030.0]), float(np.nanmean(plotting_session.spots.readings[2]))
    )
    active = np.zeros(1, dtype=int)

    def true_height(dx, dy):
        at = plotting_session.workstation.controls.counters(active)[:, 0] + (dx, dy, 0.0)
        return -float(plotting_session.height_errors(at[:, None])[0]) / plotting_session.model.metres_per_mm

    look = plotting_session.view.look(FINE_MM)
    surface = plotting_session.view.surface(look, reach=8.0)
    slope = [true_height(1, 0) - true_height(-1, 0), true_height(0, 1) - true_height(0, -1)]
    assert surface.fused
    assert surface.height == pytest.approx(true_height(0, 0), abs=0.02)
    assert surface.slope == pytest.approx(np.array(slope) / 2.0, abs=0.01)


def test_spot_heights_without_error_are_on_the_ground(plotting_session):
    errors = plotting_session.height_errors(plotting_session.spots.readings.reshape(3, -1))
    assert np.abs(errors).max() < 0.25 * UNIT_M


def test_a_contour_without_error_is_on_the_ground_within_a_quarter_of_a_counter_unit(plotting_session, contour):
    height, lines = contour
    assert lines
    errors = np.concatenate([plotting_session.height_errors(line.readings, height) for line in lines])
    assert errors.size > 20
    assert np.sqrt((errors**2).mean()) < 0.1 * UNIT_M
    assert np.abs(errors).max() < 0.25 * UNIT_M


def test_a_contour_keeps_its_z_and_ends_at_the_edge_or_at_its_start(plotting_session, contour):
    _, lines = contour
    for line in lines:
        assert np.ptp(line.readings[2]) <= 0.011
        assert line.closed or "lost" not in line.endings
        if line.closed:
            assert (line.readings[:, 0] == line.readings[:, -1]).all()
        else:
            for end in line.readings[:2, [0, -1]].T:
                assert min(*np.abs(end - plotting_session.area.low), *np.abs(plotting_session.area.high - end)) < 0.05


def test_the_errors_of_a_contour_follow_the_tremor(plotting_session, contour):
    height, _ = contour
    tremor_um = 60.0
    shaken = plotting_session.compilation(tremor_um).contour(height, plotting_session.spots)
    readings = np.concatenate([line.readings for line in shaken], axis=1)
    errors = plotting_session.height_errors(readings, height)
    east, north, _ = plotting_session.model.on_ground(readings)
    ground = plotting_session.session.scene.ground
    height_here = ground.height(east, north)
    slope = np.hypot(ground.height(east + 1.0, north) - height_here, ground.height(east, north + 1.0) - height_here)
    plan = 1e-6 * tremor_um * 8000.0
    assert np.sqrt((errors**2).mean()) == pytest.approx(np.sqrt((slope**2).mean()) * plan, rel=0.35)


def test_a_road_is_followed_along_its_middle(plotting_session):
    work = plotting_session.compilation(0.0)
    east, north = plotting_session.session.scene.lines["road1"].middle
    readings = plotting_session.model.readings_of(np.array([east, north, np.full(east.size, 455.0)]))
    within = [i for i in range(east.size) if plotting_session.area.contains(readings[:2, i])]
    start, towards, end = ((east[i], north[i]) for i in (within[2], within[4], within[-1]))
    line = work.line(LineTarget("road1", "road", start, towards, end), plotting_session.spots)
    at = plotting_session.model.on_ground(line.readings)
    off = [float(plotting_session.session.scene.lines["road1"].distance(place[:, None])[0]) for place in at[:2].T]
    assert len(off) > 5
    assert np.sqrt(np.mean(np.square(off))) < 0.4
    assert np.sqrt((plotting_session.height_errors(line.readings) ** 2).mean()) < UNIT_M


def test_vertices_are_registered_and_the_truth_does_not_cross_the_link(plotting_session, contour):
    height, _ = contour
    before = len(plotting_session.lines)
    plotting_session.compilation(0.0).contour(height, plotting_session.spots)
    crossed = plotting_session.lines[before:]
    assert any(f'REC "contour {height:g}"' in event.text for event in crossed)
    headers = {
        unit.split(" ")[0].lstrip(":") for event in crossed if event.direction == "in" for unit in event.text.split(";")
    }
    assert headers <= {
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


def test_geojson_and_svg_can_be_read_and_closed_contours_are_closed(plotting_session, contour):
    height, lines = contour
    sheet = plotting_session.sheet(lines, (height,))
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


def test_the_plotting_table_draws_at_map_scale(plotting_session):
    places = plotting_session.sheet([], ()).on_table(plotting_session.spots.readings[:, [0, -1], [0, -1]])
    ground = plotting_session.model.on_ground(plotting_session.spots.readings[:, [0, -1], [0, -1]])
    on_table, on_ground = (np.diff(each[:2], axis=1)[:, 0] for each in (places, ground))
    assert on_table == pytest.approx(1e3 * on_ground / 2500.0, abs=0.02)


def test_index_contours_are_every_fifth_of_their_interval():
    assert index_contours((440.0, 450.0, 460.0, 470.0, 500.0)) == {450.0, 500.0}
    assert index_contours((446.0, 460.0, 463.0)) == {446.0, 460.0, 463.0}


def test_a_height_outside_the_model_is_a_mistake(plotting_session):
    with pytest.raises(A7SimError, match=r"--contour 900: expected a height within the model"):
        _heights(MapRequest((900.0,), None, (), Tracing(0.0)), plotting_session.spots)
    flat = SpotHeights(np.zeros((3, 1, 2)), np.array([[1.0, 2.0]]))
    with pytest.raises(A7SimError, match="at most 100 contours"):
        _heights(MapRequest((), 0.001, (), Tracing(0.0)), flat)


@pytest.mark.parametrize(
    ("compilation_request", "message"),
    [
        (CompilationRequest("9", (460.0,)), "--model: expected one of 1, 2"),
        (CompilationRequest("1", lines=("road9",)), "--line: expected one of road1, track1, got road9"),
        (CompilationRequest("1"), "compile: expected a --contour"),
    ],
)
def test_a_compilation_requestthat_cannot_be_compiled_is_refused_before_the_session(compilation_request, message):
    with pytest.raises(A7SimError, match=message):
        compile_model(load_scenario("akwanga"), 1, compilation_request)


def test_an_unknown_line_ends_with_one_sentence_and_exit_code_2():
    done = a7sim("compile", "akwanga", "--line", "road9")
    assert done.returncode == 2
    assert done.stderr == "a7sim: --line: expected one of road1, track1, got road9\n"


def test_the_operator_gets_only_the_coordinates_of_a_points_role():
    """Plan control has NaN as height and height control NaN in plan, not the terrain's values; checks are left out."""
    scenario = load_scenario("schut-1956")
    given = given_control(scenario, build_scene(scenario, 1))
    at = dict(zip(given.points, given.coordinates.T, strict=True))
    assert set(at) == {"P1", "P2", "H1", "H2", "H3"}
    assert np.isnan(at["P1"]).tolist() == [False, False, True]
    assert np.isnan(at["H1"]).tolist() == [True, True, False]


def test_pieces_of_a_line_become_one_polyline():
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
