"""Studies: what a file may say, replicates that do not depend on how they are worked, statistics and the command."""

import pytest

from a7sim.mistakes import Mistake
from a7sim.study.cells import cells_of
from a7sim.study.loading import SHELVES, load_study, study_of
from a7sim.study.schema import Factor, Study

BY_COMPARATOR = {
    "schema_version": 1,
    "title": "Pointings",
    "question": "Do two pointings help?",
    "scenario": "a8-strip",
    "settings": {"work": ["comparator"]},
    "factor": [{"name": "pointings", "path": "comparator.pointings", "levels": [1, 4]}],
    "responses": ["strip_plan_at_checks_m", "ways.comparator.accuracy_m.checks.height"],
    "replicates": 6,
    "seed": 5,
}
AT_THE_PLOTTER = BY_COMPARATOR | {
    "scenario": "akwanga",
    "settings": {"models": [{"name": "1", "left": "101", "right": "102"}]},
    "factor": [{"name": "case", "path": "plan.case", "levels": ["A", "D"]}],
    "responses": ["residual_parallax_mm", "centre_Z_error", "hours"],
    "replicates": 3,
}


def laid(tmp_path, raw=BY_COMPARATOR, **changes):
    return study_of(raw | changes, tmp_path)


def a_design(design, *factors, **others):
    required = {"schema_version": 1, "title": "t", "question": "q", "scenario": "akwanga", "responses": ["hours"]}
    return Study(**required, design=design, factor=list(factors), **others)


CASE = Factor(name="case", path="plan.case", levels=["A", "B", "C"])
READINGS = Factor(name="readings", path="plan.parallax_readings", levels=[1, 3])


def test_a_full_design_has_every_combination_and_one_at_a_time_every_level_once():
    full = [cell.levels for cell in cells_of(a_design("full", CASE, READINGS))]
    assert len(full) == 6
    assert full[1] == {"case": "A", "readings": "3"}
    single = [tuple(cell.levels.values()) for cell in cells_of(a_design("one-at-a-time", CASE, READINGS))]
    assert single == [("A", "1"), ("B", "1"), ("C", "1"), ("A", "3")]


def test_a_latin_hypercube_has_one_cell_in_every_tenth_of_every_range():
    bx = Factor(name="bx", path="plan.bx", range=(180.0, 200.0))
    height = Factor(name="height", path="plan.projection_height", range=(300.0, 340.0))
    cells = cells_of(a_design("latin-hypercube", bx, height, samples=10))
    for path, low, high in (("plan.bx", 180.0, 200.0), ("plan.projection_height", 300.0, 340.0)):
        tenths = sorted(int(10 * (cell.settings[path] - low) / (high - low)) for cell in cells)
        assert tenths == list(range(10))


def test_settings_of_a_cell_reach_its_scenario_and_leave_the_others_alone(tmp_path):
    one, four = laid(tmp_path).scenarios
    assert (one.comparator.pointings, four.comparator.pointings) == (1, 4)
    assert one.work == four.work == ["comparator"]


@pytest.mark.parametrize("name", sorted(path.stem for shelf in SHELVES for path in shelf.glob("*.toml")))
def test_every_study_that_comes_with_a7sim_can_be_laid_out(name):
    assert len(load_study(name).cells) > 1


MISTAKES = {
    "a wrong path": ({"factor": [{"name": "f", "path": "comparator.points", "levels": [1, 2]}]}, "did you mean pointi"),
    "a level outside the schema": (
        {"factor": [{"name": "f", "path": "comparator.pointings", "levels": [1, 99]}]},
        "99",
    ),
    "one level": ({"factor": [{"name": "f", "path": "comparator.pointings", "levels": [1]}]}, "two different levels"),
    "no path": ({"factor": [{"name": "f", "levels": [1, 2]}]}, "expected the path"),
    "a range in a full design": ({"factor": [{"name": "f", "path": "plan.bx", "range": [1, 2]}]}, "latin-hypercube"),
    "a name twice": ({"factor": [BY_COMPARATOR["factor"][0]] * 2}, "every name once"),
    "no replicates": ({"replicates": None}, "replicates: expected how often"),
    "zero replicates": ({"replicates": 0}, "replicates: expected a whole number from 1"),
    "an unknown response": ({"responses": ["hour"]}, "did you mean hours?"),
    "precision of another response": ({"precision": {"response": "hours", "half_width": 0.1}}, "expected one of strip"),
    "an unknown key": ({"replicate": 3}, "did you mean replicates?"),
    "an unknown scenario": ({"scenario": "nowhere"}, "no such file"),
    "levels beyond the Z carriage": (
        {
            "scenario": "akwanga",
            "settings": {},
            "factor": [{"name": "f", "path": "plan.centre_levels", "levels": [[4900, 5100], [2000, 5100]]}],
            "responses": ["hours"],
        },
        "plan.centre_levels: expected 3686 to 6486",
    ),
}


@pytest.mark.parametrize("name", list(MISTAKES))
def test_a_mistake_gets_one_sentence_that_names_its_place(tmp_path, name):
    changes, words = MISTAKES[name]
    with pytest.raises(Mistake) as told:
        laid(tmp_path, **changes)
    assert words in str(told.value)
    assert str(told.value).startswith("study: ")
    assert len(str(told.value).splitlines()) == 1
