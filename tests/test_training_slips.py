"""The book with a slip (exercise 14): one entry is wrong, sums by hand find it, and the hidden value corrects it."""

import csv
import io
from statistics import fmean
from typing import get_args

import pytest

from a7sim.scenario.schema import SlipKind
from a7sim.training.catalogue import find_exercise
from a7sim.training.handouts import make_handout
from a7sim.training.variation import scenario_for

RIGHT = {"dove": "outside", "triangulation": "back", "diapositive": "left", "xcollar": "in", "ycollar": "out"}


def contradictions(rows):
    """Return the contradictions in a book found by repeating its sums, as a student would."""
    found = [
        f"{row['item']} {row['reading']}" for row in rows if RIGHT.get(row["item"], row["reading"]) != row["reading"]
    ]
    after = {}
    for round_ in ("1", "2"):
        rows_of_round = [row for row in rows if row["round"] == round_]
        values = {row["item"]: float(row["reading"]) for row in rows_of_round if not row["point"]}
        for name in [item.removesuffix(" before") for item in values if item.endswith("before")]:
            off = values[f"{name} before"] + values[f"{name} correction"] - values[f"{name} after"]
            if abs((off + 200.0) % 400.0 - 200.0) > 0.001:
                found.append(f"{name} does not come out in round {round_}")
            if abs(after.get(name, values[f"{name} before"]) - values[f"{name} before"]) > 0.001:
                found.append(f"{name} begins round {round_} otherwise than it ended")
            after[name] = values[f"{name} after"]
        for point in {row["point"] for row in rows_of_round if row["point"]}:
            rows_at_point = [row for row in rows_of_round if row["point"] == point]
            read = {by: [float(row["reading"]) for row in rows_at_point if row["item"] == by] for by in ("by1", "by2")}
            (mean,) = (float(row["reading"]) for row in rows_at_point if row["item"] == "mean p")
            if {len(each) for each in read.values()} != {2}:
                found.append(f"{point} has not two readings of each in round {round_}")
            elif abs((fmean(read["by1"]) - fmean(read["by2"])) / 2.0 - mean) > 0.0001:
                found.append(f"mean p at {point} does not come out in round {round_}")
    return found


@pytest.mark.parametrize("kind", get_args(SlipKind))
def test_every_kind_of_slip_gives_a_contradiction_that_its_correction_removes(kind):
    exercise = find_exercise("14")
    for seed in (1, 2, 3):
        made = make_handout("book with a slip", scenario_for(exercise, seed), seed, {"kind": kind})
        rows = list(csv.DictReader(io.StringIO(made.papers["book.csv"])))
        assert made.hidden["kind"] == kind
        assert contradictions(rows)
        wrong = rows[made.hidden["entry"] - 1]
        wrong["point" if kind == "wrong point" else "reading"] = made.hidden["right"][0]
        assert contradictions(rows) == []


def test_different_seeds_draw_different_slips_and_the_same_seed_the_same_book():
    exercise = find_exercise("14")
    made = [make_handout("book with a slip", scenario_for(exercise, seed), seed, {}) for seed in (*range(12), 0)]
    assert len({each.hidden["kind"] for each in made}) >= 5
    assert made[0] == made[-1]
