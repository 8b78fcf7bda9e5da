"""Contents of photographs: houses, edges as wide as a picture element, grain, and light falloff."""

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from a7sim.geometry import image_of, length_of, ray_of
from a7sim.scenario import load_scenario
from a7sim.scenario.schema import FilmDeformation, Water
from a7sim.scene import build_scene
from a7sim.scene.camera import fall_off
from a7sim.scene.content import SIGNAL_MM, ground_texture, signals
from a7sim.scene.coverage import within_band
from a7sim.scene.emulsion import GRAIN, Emulsion
from a7sim.scene.houses import houses_along
from a7sim.scene.lines import TONE, with_lines
from a7sim.scene.photograph import NamedPoints
from a7sim.scene.terrain import GroundSurface

FINE = 0.03
"""Size of a picture element of a close look, mm on film."""

SIGNAL_AREA = (7.0 / 4.0 - np.pi / 16.0) * SIGNAL_MM**2
"""Two arms, their crossing once, a round hole in its middle."""


@pytest.fixture(scope="module")
def scenario():
    return msgspec.structs.replace(load_scenario("akwanga"), film=FilmDeformation())


@pytest.fixture(scope="module")
def scene(scenario):
    return build_scene(scenario, 1)


@pytest.fixture(scope="module")
def houses(scenario, scene):
    return houses_along(scene.lines.values(), scene.ground, scenario.terrain.seed)


def elements(side, size):
    """Return the middles of a square of picture elements about the origin."""
    at = size * (np.arange(side) - (side - 1) / 2.0)
    return np.array(np.meshgrid(at, at))


# --- edges ----------------------------------------------------------------------------------------------


@given(
    offset=st.floats(-3.0, 3.0),
    half_width=st.floats(0.01, 2.0),
    element=st.floats(0.01, 3.0),
    parts=st.integers(2, 9),
)
def test_an_element_is_covered_as_its_parts_are_on_the_average(offset, half_width, element, parts):
    middles = offset + element * ((np.arange(parts) + 0.5) / parts - 0.5)
    whole = within_band(np.array(offset), half_width, element)
    assert whole == pytest.approx(within_band(middles, half_width, element / parts).mean(), abs=1e-9)


def test_an_element_without_width_lies_in_a_band_or_beside_it():
    assert within_band(np.array([-1.1, -0.9, 0.0, 0.9, 1.1, np.inf]), 1.0, 0.0).tolist() == [0, 1, 1, 1, 0, 0]


@pytest.mark.parametrize("size", [0.004, 0.03, 0.09, 0.17, 0.4, 0.7])
def test_a_signal_gives_as_much_light_in_elements_of_any_size_wherever_it_lies_among_them(size):
    around = elements(2 * round(0.6 / size) + 3, size)
    for place in ((0.0, 0.0), (0.31 * size, 0.48 * size)):
        covered = signals(NamedPoints(("P",), np.array(place)[:, None]))(around, size)
        assert covered.max() <= 1.0 + 1e-12
        assert covered.sum() * size**2 == pytest.approx(SIGNAL_AREA, rel=0.04)


def test_a_road_gives_as_much_light_in_elements_of_any_size(scene):
    """Summed across the road, what its cover adds is its width: it neither vanishes nor swells when seen from afar."""
    road = scene.lines["road1"]
    middle = road.middle[:, 40]
    along = road.middle[:, 41] - middle
    across = np.array([-along[1], along[0]]) / length_of(along)
    for size in (0.3, 1.0, 4.0, 11.0):
        places = middle[:, None] + across[:, None] * size * np.arange(-20.0, 21.0)
        distance = road.distance(places, road.width + size)
        assert size * within_band(distance, road.width / 2.0, size).sum() == pytest.approx(road.width, rel=0.05)


# --- houses ---------------------------------------------------------------------------------------------


def test_houses_stand_along_the_roads_beside_them_and_clear_of_each_other(scene, houses):
    length = sum(length_of(np.diff(line.middle)).sum() for line in scene.lines.values())
    assert 1.0 < houses.middle.shape[1] / (length / 100.0) < 4.0
    assert (houses.half >= 4.0).all()
    assert (houses.half <= 7.5).all()
    for line in scene.lines.values():
        assert (line.distance(houses.middle, 500.0) > line.width / 2.0 + houses.reach).all()
    to_a_road = np.min([line.distance(houses.middle, 500.0) for line in scene.lines.values()], axis=0)
    assert (to_a_road < 35.0).all()
    apart = length_of(houses.middle[:, :, None] - houses.middle[:, None, :])
    np.fill_diagonal(apart, np.inf)
    assert (apart > houses.reach + houses.reach[:, None]).all()


def test_the_same_terrain_has_the_same_houses_and_another_has_others(scenario, scene, houses):
    again = houses_along(scene.lines.values(), scene.ground, scenario.terrain.seed)
    np.testing.assert_array_equal(houses.middle, again.middle)
    other = houses_along(scene.lines.values(), scene.ground, scenario.terrain.seed + 1)
    assert other.middle.shape != houses.middle.shape or np.abs(other.middle - houses.middle).max() > 1.0


def test_no_house_stands_in_water_and_none_where_there_is_no_road(scenario, scene, houses):
    east, north = houses.middle[:, 0]
    shore = [(east - 30.0, north - 30.0), (east + 30.0, north - 30.0), (east + 30.0, north + 30.0), (east, north)]
    flooded = GroundSurface.of(msgspec.structs.replace(scenario.terrain, water=[Water(shore=shore)]))
    assert flooded.under_water(houses.middle + 1e-3 * np.array([[1.0], [-1.0]])).any()
    dry = houses_along(scene.lines.values(), flooded, scenario.terrain.seed)
    assert not flooded.under_water(dry.middle).any()
    assert houses_along((), scene.ground, 1).middle.shape == (2, 0)


def on_film(scenario, scene, photo, plan):
    """Return where a photograph without film errors shows ground places ``(2, n)``, to some hundredths of a mm."""
    station = scene.stations[photo]
    places = np.array([*plan, scene.ground.height(*plan)])
    return image_of(places, station.centre[:, None], station.rotation, scenario.camera.c)


def test_both_photographs_show_the_same_roofs_and_none_is_as_light_as_a_road(scenario, scene, houses):
    """Laid over each other by the ground, the two pictures of a house differ by grain alone, edges and all."""
    covered = 0
    for middle in houses.middle.T:
        plan = middle[:, None, None] + elements(25, 1.0)
        flat = plan.reshape(2, -1)
        seen = [on_film(scenario, scene, photo, flat) for photo in ("101", "102")]
        if max(np.abs(each).max() for each in seen) > 105.0:
            continue
        left, right = (
            scene.photographs[photo].content(xy, 0.1) / fall_off(scenario.camera, xy)
            for photo, xy in zip(("101", "102"), seen, strict=True)
        )
        assert np.corrcoef(left, right)[0, 1] > 0.99
        assert left[len(left) // 2] < TONE - 0.3
        covered += 1
    assert covered > 5


def test_pictures_of_old_sessions_have_sharp_edges_and_only_ground_and_roads(scenario, scene, houses):
    """Old sessions are replayed with their pictures: no houses, no grain, light even, elements without width."""
    before = build_scene(scenario, 1, 1).photographs["101"].content
    plan = houses.middle[:, 7, None, None] + elements(25, 1.0)
    seen = on_film(scenario, scene, "101", plan.reshape(2, -1))
    np.testing.assert_array_equal(before(seen, FINE), before(seen, 1.0))
    station, offset = scene.stations["101"], np.array(scenario.camera.principal_point)[:, None]
    met = scene.ground.intersect(station.centre, ray_of(seen - offset, station.rotation, scenario.camera.c))[:2]
    bare = with_lines(tuple(scene.lines.values()), met, ground_texture(*met), 0.0)
    np.testing.assert_allclose(before(seen, FINE), bare, atol=1e-9)


# --- film and camera ------------------------------------------------------------------------------------


def grain(emulsion, size, side=60):
    xy = elements(side, size) + 20.0
    return emulsion.exposed(xy, np.full(xy.shape[1:], 0.5), size) - 0.5


def test_grain_belongs_to_a_film_and_stays_where_it_is():
    drawn = Emulsion(7, (1, 0))
    pattern = grain(drawn, FINE)
    np.testing.assert_array_equal(pattern, grain(Emulsion(7, (1, 0)), FINE))
    for other in (Emulsion(8, (1, 0)), Emulsion(7, (1, 1))):
        assert abs(np.corrcoef(pattern.ravel(), grain(other, FINE).ravel())[0, 1]) < 0.1
    xy = elements(40, FINE)
    light = np.full(xy.shape[1:], 0.5)
    still, moved = drawn.exposed(xy, light, FINE), drawn.exposed(xy + 0.001, light, FINE)
    assert np.corrcoef(still.ravel(), moved.ravel())[0, 1] > 0.97


def test_grain_is_a_few_greys_and_averages_out_in_large_elements():
    """The spread of a mean over many clumps decreases with the side of the element."""
    drawn = Emulsion(7, (1, 0))
    spread = {size: grain(drawn, size).std() for size in (0.015, 0.03, 0.06, 0.24)}
    assert 1.0 < 255.0 * spread[0.015] < 5.0
    for size in (0.03, 0.06, 0.24):
        assert spread[size] * size == pytest.approx(spread[0.015] * 0.015, rel=0.2)
    assert np.abs(grain(drawn, 0.015)).max() <= GRAIN


def test_light_falls_off_towards_the_corners_and_is_whole_in_the_middle(scenario):
    """By the power of the cosine of the angle from the axis that the graded filter leaves."""
    corner = np.array([[0.0, 110.0], [0.0, 110.0]])
    light = fall_off(scenario.camera, corner)
    assert light[0] == 1.0
    assert light[1] == pytest.approx(np.cos(np.arctan(length_of(corner[:, 1]) / scenario.camera.c)))


def test_ground_of_one_tone_is_darker_in_a_corner_of_the_photograph(scenario):
    east, north = 440000.0, 985000.0
    shore = [(east - 1e4, north - 1e4), (east + 1e4, north - 1e4), (east + 1e4, north + 1e4), (east - 1e4, north + 1e4)]
    water = [Water(shore=shore)]
    terrain = msgspec.structs.replace(scenario.terrain, water=water)
    photograph = build_scene(msgspec.structs.replace(scenario, terrain=terrain), 1).photographs["101"]
    middle, corner = (photograph.content(elements(30, 0.1) + at, 0.1).mean() for at in (0.0, 95.0))
    assert corner / middle == pytest.approx(0.75, abs=0.02)
