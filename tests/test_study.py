"""Studies: keys of the file, replicates that do not depend on the executor, statistics and the command."""

import numpy as np
import pytest

from a7sim.errors import A7SimError
from a7sim.study.cells import make_cells
from a7sim.study.checkpoint import save
from a7sim.study.executors import open_executor
from a7sim.study.loading import SEARCH_PATH, build_study, load_study
from a7sim.study.running import ChunkPolicy, _Size, run_study
from a7sim.study.schema import Factor, StudyDefinition
from a7sim.study.tally import Tally

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


def laid(tmp_path, raw=BY_COMPARATOR, **changes):
    return build_study(raw | changes, tmp_path)


def a_design(design, *factors, **others):
    required = {"schema_version": 1, "title": "t", "question": "q", "scenario": "akwanga", "responses": ["hours"]}
    return StudyDefinition(**required, design=design, factor=list(factors), **others)


CASE = Factor(name="case", path="plan.case", levels=["A", "B", "C"])
READINGS = Factor(name="readings", path="plan.parallax_readings", levels=[1, 3])


def test_a_full_design_has_every_combination_and_one_at_a_time_every_level_once():
    full = [cell.levels for cell in make_cells(a_design("full", CASE, READINGS))]
    assert len(full) == 6
    assert full[1] == {"case": "A", "readings": "3"}
    single = [tuple(cell.levels.values()) for cell in make_cells(a_design("one-at-a-time", CASE, READINGS))]
    assert single == [("A", "1"), ("B", "1"), ("C", "1"), ("A", "3")]


def test_a_latin_hypercube_has_one_cell_in_every_tenth_of_every_range():
    bx = Factor(name="bx", path="plan.bx", range=(180.0, 200.0))
    height = Factor(name="height", path="plan.projection_height", range=(300.0, 340.0))
    cells = make_cells(a_design("latin-hypercube", bx, height, samples=10))
    for path, low, high in (("plan.bx", 180.0, 200.0), ("plan.projection_height", 300.0, 340.0)):
        tenths = sorted(int(10 * (cell.settings[path] - low) / (high - low)) for cell in cells)
        assert tenths == list(range(10))


def test_settings_of_a_cell_change_only_its_scenario(tmp_path):
    one, four = laid(tmp_path).scenarios
    assert (one.comparator.pointings, four.comparator.pointings) == (1, 4)
    assert one.work == four.work == ["comparator"]


@pytest.mark.parametrize("name", sorted(path.stem for shelf in SEARCH_PATH for path in shelf.glob("*.toml")))
def test_every_shipped_study_can_be_loaded(name):
    assert len(load_study(name).cells) > 1


def numbers_of(laid_study, kind="process", largest_chunk=2000, tally=None):
    tally = tally or Tally.empty(len(laid_study.cells), len(laid_study.responses))
    with open_executor(kind, 2 if kind == "pool" else None) as (executor, at_once):
        run_study(laid_study, tally, executor, at_once, pace=ChunkPolicy(largest_chunk=largest_chunk))
    return tally


def bytes_of(tally, folder):
    save(tally, folder / "tally.npz", "study")
    return (folder / "tally.npz").read_bytes()


@pytest.fixture(scope="module")
def by_comparator(tmp_path_factory):
    study = laid(tmp_path_factory.mktemp("study"))
    return study, numbers_of(study)


@pytest.mark.parametrize(("kind", "largest_chunk"), [("process", 1), ("process", 4), ("pool", 2)])
def test_a_study_gives_the_same_bytes_for_any_chunk_size_and_executor(by_comparator, tmp_path, kind, largest_chunk):
    study, tally = by_comparator
    assert bytes_of(numbers_of(study, kind, largest_chunk), tmp_path) == bytes_of(tally, tmp_path)


def test_cells_share_their_random_numbers_so_that_the_same_level_gives_the_same_numbers(tmp_path):
    """Common random numbers: cells that differ in nothing that matters give identical replicates."""
    study = laid(tmp_path, factor=[{"name": "f", "path": "plan.tolerated_centre_rms", "levels": [0.5, 0.6]}])
    tally = numbers_of(study)
    assert np.array_equal(tally.sample(0), tally.sample(1))
    assert len(set(tally.sample(0)[0])) == 6


@pytest.mark.parametrize(("half_width", "replicates"), [(10.0, 2), (1e-6, 5)])
def test_a_study_ends_when_its_precision_is_reached_or_its_replicates_are_done(
    tmp_path, monkeypatch, half_width, replicates
):
    monkeypatch.setattr("a7sim.study.running.STEP", 2)
    wanted = {"response": "strip_plan_at_checks_m", "half_width": half_width}
    assert numbers_of(laid(tmp_path, precision=wanted, replicates=5)).done.tolist() == [replicates] * 2


def test_the_error_message_for_a_response_missing_in_the_results_names_its_place(tmp_path):
    with pytest.raises(A7SimError, match=r"at ways there are comparator, not 'A8'"):
        numbers_of(laid(tmp_path, responses=["ways.A8.accuracy_m.checks.plan"]))


MISTAKES = {
    "a wrong path": ({"factor": [{"name": "f", "path": "comparator.points", "levels": [1, 2]}]}, "did you mean pointi"),
    "a level outside the schema": (
        {"factor": [{"name": "f", "path": "comparator.pointings", "levels": [1, 99]}]},
        "99",
    ),
    "one level": ({"factor": [{"name": "f", "path": "comparator.pointings", "levels": [1]}]}, "two different levels"),
    "no path": ({"factor": [{"name": "f", "levels": [1, 2]}]}, "expected the path"),
    "a range in a full design": ({"factor": [{"name": "f", "path": "plan.bx", "range": [1, 2]}]}, "latin-hypercube"),
    "a range beside levels": (
        {
            "design": "latin-hypercube",
            "samples": 4,
            "factor": [{"name": "f", "path": "plan.bx", "range": [1, 2], "levels": [1, 2]}],
        },
        "expected a path and a range from low to high alone, got 1 to 2",
    ),
    "a range of nothing": (
        {"design": "latin-hypercube", "samples": 4, "factor": [{"name": "f", "path": "plan.bx", "range": [2, 2]}]},
        "expected a path and a range from low to high alone, got 2 to 2",
    ),
    "groups beside levels": (
        {"factor": [BY_COMPARATOR["factor"][0] | {"groups": {"one": {"comparator.pointings": 1}}}]},
        "expected either path and levels or groups, got both",
    ),
    "a hypercube of no size": (
        {"design": "latin-hypercube", "factor": [{"name": "f", "path": "film.irregular_um", "range": [1, 2]}]},
        "samples: expected the number of cells",
    ),
    "too many cells": (
        {
            "factor": [
                {"name": f"f{i}", "path": "film.irregular_um", "levels": [k / 100 for k in range(101)]}
                for i in range(3)
            ]
        },
        "expected levels that make at most",
    ),
    "a response twice": ({"responses": ["strip_plan_at_checks_m"] * 2}, "responses: expected every response once"),
    "a height gear that is not there": (
        {
            "scenario": "akwanga",
            "settings": {},
            "factor": [{"name": "f", "path": "plan.height_gear", "levels": ["1:1", "1:9999"]}],
            "responses": ["hours"],
        },
        "height_gear",
    ),
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
    "tilts beyond an element": (
        {
            "scenario": "akwanga",
            "settings": {},
            "factor": [{"name": "f", "path": "photos.0.omega", "levels": [1.0, -12.0]}],
            "responses": ["hours"],
        },
        "omega1 of the A7 can take (70 to 109 gon), got 111",
    ),
    "a scenario in its place": ({"photos": []}, "expected a study, got a scenario"),
    "a study in the place of its scenario": ({"scenario": "study.toml"}, "expected a scenario, got a study"),
}


@pytest.mark.parametrize("name", list(MISTAKES))
def test_the_error_message_for_a_mistake_is_one_sentence_and_names_its_place(tmp_path, name):
    changes, words = MISTAKES[name]
    (tmp_path / "study.toml").write_text('responses = ["hours"]')
    with pytest.raises(A7SimError) as raised:
        laid(tmp_path, **changes) if "photos" not in changes else build_study(changes, tmp_path)
    assert words in str(raised.value)
    assert str(raised.value).startswith("study: ")
    assert len(str(raised.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("opening", "each", "settled"),
    [
        (30.0, 0.1, range(2700, 2701)),
        (60.0, 0.1, range(5000, 5001)),
        (0.0, 0.02, range(990, 1001)),
        (0.0, 3.0, range(1, 8)),
    ],
)
def test_chunk_sizes_balance_opening_and_running(opening, each, settled):
    """A task that is slow to open runs in long chunks, to a limit; one that opens at once, for about twenty seconds."""
    size = _Size(ChunkPolicy())
    for _ in range(8):
        size.learn(size.best, opening + each * size.best)
    assert size.best in settled
