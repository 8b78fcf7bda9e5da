"""Exercises 10 to 13 and 15: the formulas of their texts are correct, and their papers can be solved."""

from collections import defaultdict

import numpy as np
import pytest

from a7sim.geometry import GON
from a7sim.session.grid_test import true_errors
from a7sim.training.attempts import run_attempt
from a7sim.training.catalogue import find_exercise
from a7sim.training.exercise import PlayedRun
from a7sim.training.grading import grade_record, load_record
from a7sim.training.handouts import make_handout
from a7sim.training.metrics.ground import element_at, last_readings
from a7sim.training.variation import scenario_for

PERFECT = {
    "parallax_um": 0.0,
    "monocular_um": 0.0,
    "stereo_um": 0.0,
    "height_um": 0.0,
    "fiducial_um": 0.0,
    "last_digit_slip": 0.0,
    "blunder_rate": 0.0,
}


@pytest.fixture(scope="module")
def grid_tested(tmp_path_factory):
    exercise_folder, folder = find_exercise("13"), tmp_path_factory.mktemp("grid")
    assert run_attempt(exercise_folder, exercise_folder.exercise.reference, folder, 3) == ""
    return load_record(exercise_folder, 3, folder)


@pytest.mark.parametrize("projector", [1, 2])
def test_the_grid_test_by_hand_finds_the_errors_of_a_worn_projector(grid_tested, projector):
    """Apply the three formulas of the text to the registered counters of nine crosses at two levels."""
    read = defaultdict(list)
    for each in grid_tested.readings:
        if each.eyes[projector - 1] is not None:
            read[round(each.counters["Z"]), each.point].append([each.counters[axis] for axis in "XY"])
    high, low = sorted({level for level, _ in read}, reverse=True)
    names = [[f"G{row}{column}" for column in (1, 5, 9)] for row in (1, 5, 9)]
    x, y = np.moveaxis(
        [[[np.mean(read[level, name], axis=0) for name in row] for row in names] for level in (high, low)], -1, 0
    )
    spans = np.concatenate([x[:, :, 2] - x[:, :, 0], y[:, 2] - y[:, 0]], axis=1)
    shown = grid_tested.autograph.element(f"c{projector}")
    c = np.mean(200.0 * (high - low) / (spans[1] - spans[0]))
    bent = shown**2 / (2.0 * -np.array([high, low]) * 100.0**2)
    phi = -np.mean(bent[:, None] * (x[:, :, 2] + x[:, :, 0] - 2.0 * x[:, :, 1])) / GON
    omega = np.mean(bent[:, None] * (y[:, 2] + y[:, 0] - 2.0 * y[:, 1])) / GON
    truth = true_errors(grid_tested.autograph, grid_tested.autograph.condition, projector)["errors"]
    assert c - shown == pytest.approx(truth["c"], abs=0.06)
    assert phi == pytest.approx(truth["phi"], abs=0.05)
    assert omega == pytest.approx(truth["omega"], abs=0.05)
    assert abs(truth["c"]) > 0.06


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
def test_the_misread_point_can_be_found_and_the_strip_gives_the_true_ground(seed, tmp_path):
    exercise_folder = find_exercise("12")
    scenario = scenario_for(exercise_folder, seed)
    made = make_handout("model sheets", scenario, seed, exercise_folder.exercise.handout_options)
    assert run_attempt(exercise_folder, exercise_folder.exercise.reference, tmp_path, seed) == ""
    record = load_record(exercise_folder, seed, tmp_path)
    assert record.answers["bad"] == made.hidden["bad"]
    for name in ("8003", "8005"):
        found = [float(record.answers[f"{axis}{name}"]) for axis in "xyz"]
        assert found == pytest.approx(record.scene.ground_points[name], abs=1.0)


def test_a_misread_point_left_in_the_strip_is_reported_with_its_coordinate(tmp_path):
    exercise_folder = find_exercise("12")
    played = PlayedRun(procedure="strip by cards", options={"wanted": ["8003", "8005"], "leave_out": False})
    assert run_attempt(exercise_folder, played, tmp_path, 12) == ""
    failed = {each.id: each for each in grade_record(load_record(exercise_folder, 12, tmp_path)).failed}
    assert set(failed) == {"plan"}
    assert "y8003 was answered" in failed["plan"].sentence


@pytest.fixture(scope="module")
def levelled(tmp_path_factory):
    exercise_folder, folder = find_exercise("10"), tmp_path_factory.mktemp("levelled")
    assert run_attempt(exercise_folder, PlayedRun(procedure="absolute orientation", observer=PERFECT), folder, 8) == ""
    return load_record(exercise_folder, 8, folder)


def test_levelling_turns_both_projectors_as_the_text_describes(levelled):
    """Both phi change equally, both omega too, and the right centre sinks by bx times the change of phi (T 3.5)."""
    opened = max(each.index for each in levelled.action_log.actions if each.client == "opening") + 1
    level = last_readings(levelled, ["K1"])["K1"][-1]
    turned = {
        name: level.counters[name] - element_at(levelled, name, opened)
        for name in ("phi1", "phi2", "omega1", "omega2", "bz1", "bz2")
    }
    assert turned["phi1"] == pytest.approx(turned["phi2"], abs=0.02)
    assert turned["omega1"] == pytest.approx(turned["omega2"], abs=0.02)
    assert abs(turned["phi1"]) > 0.03
    sunk = -(turned["bz2"] - turned["bz1"])
    assert sunk == pytest.approx(level.counters["bx"] * turned["phi1"] * GON, abs=0.03)


def test_a_perfect_eye_has_only_the_residuals_of_film_and_counts(levelled):
    marks = {each.id: each for each in grade_record(levelled).marks}
    assert marks["heights"].value < 0.15 and marks["on-the-ground"].value < 4.0
