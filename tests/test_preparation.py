"""Settings before a picture is mounted: the thesis's own numbers, and the limits that exclude a scale."""

import re

import pytest
from click.testing import CliRunner

from a7sim.cli import cli
from a7sim.errors import A7SimError
from a7sim.operator.mapping.preparation import FlightPlan, choose_settings
from a7sim.plotters import A7, A8

AKWANGA = FlightPlan.of_heights(152.676, 91.0, (430.24, 487.92), photo_scale=8000.0)


def test_the_theses_flight_is_that_of_section_3_2_3():
    """T: 1221.408 m above 459.080 m, 1192.568 to 1250.248 m above the ground, wide angle."""
    assert AKWANGA.mean_ground == pytest.approx(459.08)
    assert AKWANGA.flying_height == pytest.approx(1221.408)
    assert AKWANGA.lowest_flown == pytest.approx(1192.568)
    assert AKWANGA.highest_flown == pytest.approx(1250.248)
    assert AKWANGA.angle == "wide"


def test_the_theses_settings_come_out():
    """T: 1:3750, Cd, 1-2-1, 325.709 mm; its optimum is 490 / 152.676 / 8000, printed 1/2496.669 for 1/2492.669."""
    found = choose_settings(AKWANGA, A7, map_scale=2500.0)
    assert found.optimum == pytest.approx(2492.669, abs=5e-4)
    assert found.chosen.number == 3750.0
    assert (found.chosen.height_gear, found.chosen.plan_gear) == ("Cd", "1-2-1")
    assert found.chosen.interval == pytest.approx(0.01)
    assert found.chosen.projection_height == pytest.approx(325.709, abs=5e-4)


def test_the_base_is_what_the_photo_base_promises_at_the_scale():
    """The photo base of 91 mm promises 0.9 mm less than T cleared at points 1 and 2."""
    assert choose_settings(AKWANGA, A7, 2500.0).chosen.bx == pytest.approx(91.0 * 8000.0 / 3750.0)


def test_the_optimum_asks_for_a_base_beyond_the_range():
    """Why a smaller model is taken at all: bx ends at 280 mm."""
    assert choose_settings(AKWANGA, A7).optimum_bx > A7.elements["bx"].high


def test_without_a_map_the_largest_model_with_fine_heights_is_taken():
    assert choose_settings(AKWANGA, A7).chosen.height_gear == "Bd"


def test_every_scale_that_is_left_keeps_all_ranges():
    for height in range(400, 2000, 50):
        flight = FlightPlan.of_heights(152.676, 91.0, (100.0, 150.0), flying_height=float(height))
        try:
            chosen = choose_settings(flight, A7).chosen
        except A7SimError as none:
            assert "range" in str(none)
            continue
        low, high = A7.carriages["Z"]
        assert -high <= chosen.lowest < chosen.projection_height < chosen.highest <= -low
        assert chosen.bx <= A7.elements["bx"].high
        assert chosen.width <= A7.carriages["Y"][1]


@pytest.mark.parametrize("flying_height", [300.0, 2000.0])
def test_a_flight_too_low_or_too_high_is_refused(flying_height):
    flight = FlightPlan.of_heights(152.676, 91.0, (100.0, 110.0), flying_height=flying_height)
    with pytest.raises(A7SimError, match="needs Z"):
        choose_settings(flight, A7)


@pytest.mark.parametrize(
    ("flying_height", "photo_base", "reason"), [(1410.0, 91.0, "needs bx"), (1410.0, 60.0, "needs Y -354")]
)
def test_the_reason_that_excludes_the_largest_model_is_reported(flying_height, photo_base, reason):
    """At 1:3000 and 470 mm: a base of 91 mm becomes 280.1 mm, the corners of the picture lie 354 mm off the base."""
    flight = FlightPlan.of_heights(152.676, photo_base, (100.0, 110.0), flying_height=flying_height)
    largest = choose_settings(flight, A7).scales[0]
    assert any(each.startswith(reason) for each in largest.reason_rejected)


def test_a_map_without_a_horizontal_gear_is_refused():
    with pytest.raises(A7SimError, match="no horizontal gear to 1:4000"):
        choose_settings(AKWANGA, A7, map_scale=4000.0)


def test_another_plotter_has_other_ranges_and_gears():
    chosen = choose_settings(AKWANGA, A8).chosen
    assert chosen.height_gear in A8.height_gears
    assert 175.0 <= chosen.lowest < chosen.highest <= 350.0


@pytest.mark.parametrize("given", [{}, {"photo_scale": 8000.0, "flying_height": 1200.0}, {"flying_height": -5.0}])
def test_a_flight_needs_a_scale_or_a_height(given):
    with pytest.raises(A7SimError):
        FlightPlan.of_heights(152.676, 91.0, (430.24, 487.92), **given)


def test_the_command_prints_the_sheet():
    line = "prepare --c 152.676 --photo-scale 8000 --photo-base 91 --heights 430.24 487.92 --map-scale 2500"
    done = CliRunner().invoke(cli, line.split())
    assert done.exit_code == 0
    for number in ("1:2492.7", "1:3750", "325.709 mm", "194.13 mm", "Cd", "1-2-1"):
        assert number in done.output


@pytest.mark.parametrize("option", ["--c", "--flying-height", "--photo-base", "--map-scale"])
@pytest.mark.parametrize("value", ["0", "nan", "-1"])
def test_a_value_not_above_zero_is_refused_with_one_sentence(typed, option, value):
    flight = {"--c": "152", "--flying-height": "1200", "--photo-base": "91", "--map-scale": "2500"} | {option: value}
    words = [word for pair in flight.items() for word in pair]
    code, _, err = typed("prepare", *words, "--heights", "400", "500")
    assert (code, err.count("\n")) == (2, 1)
    assert re.match(f"a7sim: {option}: expected (more than|a finite number|1 to)", err)
