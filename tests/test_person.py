"""The operator: skill profiles, warm-up and fatigue, slips of seven kinds, and the timesheet."""

import dataclasses
import json
from functools import cache

import msgspec
import numpy as np
import pytest

from a7sim.operator import OperatorGaveUp, measure_models
from a7sim.operator.people.fatigue import HOUR, acuity_factor, slip_factor
from a7sim.operator.people.slips import neighbours, transpositions
from a7sim.scenario import PROFILES, Observer, ScenarioError, load_scenario, observer_of_skill, scenario_schema
from a7sim.scenario.schema import FilmDeformation, PlannedSlip
from a7sim.session import RunOptions, open_session, run
from a7sim.session.session_batch import open_batch
from tests.support.processes import a7sim_in_process
from tests.support.sessions import read_once

WITHOUT_SLIPS = dict.fromkeys(
    (
        "last_digit_slip",
        "blunder_rate",
        "wrong_point_rate",
        "wrong_sign_rate",
        "transposed_rate",
        "forgotten_lever_rate",
        "not_reread_rate",
    ),
    0.0,
)


def one_model(observer=None, **changes):
    """Akwanga's first model, by its default observer or another."""
    scenario = load_scenario("akwanga")
    observer = scenario.observer if observer is None else observer
    return msgspec.structs.replace(scenario, models=scenario.models[:1], observer=observer, **changes)


# --- the default observer ---------------------------------------------------------------------------


def test_a_plain_observer_neither_tires_nor_warms_up_nor_rests():
    hours = np.linspace(0.0, 12.0, 25) * HOUR
    assert (acuity_factor(Observer(), hours, hours) == 1.0).all()
    assert (slip_factor(Observer(), hours) == 1.0).all()
    assert not Observer().takes_breaks


# --- profiles ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("skill", list(PROFILES))
def test_a_skill_is_a_word_or_a_table_whose_own_words_stand(skill):
    by_word = load_scenario("akwanga", {"observer": skill}).observer
    assert by_word == load_scenario("akwanga", {"observer.skill": skill}).observer == observer_of_skill(skill)
    changed = load_scenario("akwanga", {"observer.skill": skill, "observer.height_um": "9.5"}).observer
    assert changed == msgspec.structs.replace(by_word, height_um=9.5)


def test_from_novice_to_first_order_everything_gets_better():
    novice, trained, first = (observer_of_skill(skill) for skill in ("novice", "trained", "first-order"))
    for name in (*WITHOUT_SLIPS, "parallax_um", "monocular_um", "stereo_um", "height_um", "repeat_share", "pace"):
        assert getattr(novice, name) > getattr(trained, name) > getattr(first, name), name


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    [
        ({"observer": "expert"}, "observer: expected 'novice', 'trained', 'first-order' or a table, got \"expert\""),
        ({"observer.skill": "expert"}, "observer.skill: expected 'first-order' or 'novice' or 'trained'"),
        ({"observer.skil": '"novice"'}, "observer.skil: expected a key that is known; did you mean skill?"),
        ({"observer.certain_slips": "[{ kind = 'fall asleep' }]"}, r"observer.certain_slips[0].kind: expected"),
        (
            {"observer.certain_slips": "[{ kind = 'gross', model = '9' }]"},
            "observer.certain_slips[0].model: expected the name of a model (1, 2), got '9'",
        ),
    ],
)
def test_error_messages_name_mistakes_about_the_observer(overrides, sentence):
    with pytest.raises(ScenarioError) as error:
        load_scenario("akwanga", overrides)
    assert sentence in str(error.value)


def test_the_schema_takes_the_word_and_the_table():
    observer = scenario_schema()["$defs"]["Scenario"]["properties"]["observer"]
    assert observer["anyOf"] == [{"enum": list(PROFILES)}, {"$ref": "#/$defs/Observer"}]


def test_the_command_line_knows_the_skills():
    done = a7sim_in_process("run", "akwanga", "--skill", "expert")
    assert done.returncode == 2
    assert all(skill in done.stderr for skill in PROFILES)


@cache
def batch_of(skill):
    """Return a batch of twelve operators of a skill without slips, on film without errors."""
    scenario = read_once(one_model(observer_of_skill(skill, **WITHOUT_SLIPS), film=FilmDeformation()))
    batch = open_batch(scenario, range(12))
    (records,) = batch.measure_models()
    return batch, records


@pytest.mark.slow
def test_the_profiles_differ_in_residuals_in_centres_and_in_time():
    found = {skill: batch_of(skill) for skill in ("first-order", "trained", "novice")}
    for measure in (
        lambda batch, records: np.median(records.orientation.rms),
        lambda batch, records: np.median([records.centres[hand].rms for hand in (1, 2)]),
        lambda batch, records: np.median(batch.workstation.operators.seconds),
    ):
        first, trained, novice = (measure(*each) for each in found.values())
        assert first < trained < novice
    assert [batch.workstation.operators.reasons for batch, _ in found.values()] == [{}, {}, {}]


@pytest.mark.slow
def test_a_novice_in_a_batch_equals_the_novice_over_the_link():
    scenario, seeds = one_model(observer_of_skill("novice")), (4, 5)
    batch = open_batch(scenario, seeds)
    (records,) = batch.measure_models()
    assert all(batch.workstation.operators.slip_log[i] for i in range(len(seeds)))
    for i, seed in enumerate(seeds):
        session = open_session(scenario, seed)
        record = next(iter(measure_models(session.person, session.job)))
        assert record.orientation.elements == records.for_session(i).orientation.elements
        assert [_without_place(slip) for slip in session.person.slips] == [
            _without_place(slip) for slip in batch.workstation.operators.slip_log[i]
        ]
        assert session.person.timesheet.acts_of(0) == batch.workstation.operators.timesheet.acts_of(i)


def _without_place(slip):
    return dataclasses.replace(slip, entry=0, round=0)


# --- warm-up, fatigue, breaks -----------------------------------------------------------------------


def test_warm_up_falls_evenly_to_nothing_and_fatigue_grows_once_no_longer_fresh():
    person = Observer(warm_up=0.5, warm_up_minutes=30.0, fresh_hours=2.0, fatigue_per_hour=0.1)
    at_work, since_rest = np.array([0.0, 0.25, 0.5, 2.0, 5.0]) * HOUR, np.array([0.0, 0.25, 0.5, 2.0, 4.0]) * HOUR
    assert acuity_factor(person, at_work, since_rest) == pytest.approx([1.5, 1.25, 1.0, 1.0, 1.2])
    assert slip_factor(Observer(slip_fatigue_per_hour=0.5), since_rest) == pytest.approx([1.0, 1.0, 1.0, 1.5, 2.5])


def test_settings_of_a_tired_operator_scatter_more_and_a_break_restores_the_scatter():
    """The same draws, larger by the factor of the hour; after a break as at the start."""
    tired = open_batch(
        one_model(Observer(fresh_hours=0.0, fatigue_per_hour=1.0, takes_breaks=True)), (1,)
    ).workstation.operators
    fresh = open_batch(one_model(Observer()), (1,)).workstation.operators
    active = tired.active
    for operators in (tired, fresh):
        operators.spend(active, 3.0 * HOUR)
    assert tired.draw_setting_errors(active, 1.0, (50,)) == pytest.approx(
        4.0 * fresh.draw_setting_errors(active, 1.0, (50,))
    )
    tired.begin_round(active, 2)
    assert tired.draw_setting_errors(active, 1.0, (50,)) == pytest.approx(fresh.draw_setting_errors(active, 1.0, (50,)))
    assert tired.timesheet.activities_of(0)["breaks"] == 900.0


def test_only_operators_that_are_due_take_a_break():
    operators = open_batch(one_model(Observer(takes_breaks=True)), (1, 2)).workstation.operators
    operators.spend(operators.active[:1], 2.5 * HOUR)
    operators.begin(operators.active, "1", "relative orientation")
    assert operators.seconds.tolist() == [2.75 * HOUR, 0.0]


# --- time -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("skill", ["trained", "novice"])
def test_the_time_adds_up(skill):
    session = open_session(read_once(one_model(observer_of_skill(skill, **WITHOUT_SLIPS))), 2)
    next(iter(measure_models(session.person, session.job)))
    person = session.person
    for column in (person.timesheet.activities_of(0), person.timesheet.acts_of(0)):
        assert sum(column.values()) == pytest.approx(person.clock.now, rel=1e-12)
        assert "other" not in column
    assert {"mounting and interior orientation", "relative orientation", "model coordinates", "perspective centres",
            "computing", "breaks"} == set(person.timesheet.activities_of(0))  # fmt: skip


def test_pace_makes_everything_slower_but_breaks():
    slow, usual = (open_batch(one_model(Observer(pace=pace)), (1,)).workstation.operators for pace in (1.5, 1.0))
    for operators in (slow, usual):
        operators.spend(operators.active, 10.0, "looking")
    assert (slow.seconds[0], usual.seconds[0]) == (15.0, 10.0)


# --- slips ------------------------------------------------------------------------------------------


@cache
def planted(kind, **place):
    """Return an operator with one certain slip, the record of the model and the reason of giving up.

    With a forgotten lever parallaxes are read three times, otherwise once.
    """
    slip = PlannedSlip(kind=kind, model="1", **place)
    observer = msgspec.structs.replace(Observer(**WITHOUT_SLIPS), certain_slips=[slip])
    scenario = one_model(observer)
    session = open_session(scenario if kind == "forgotten lever" else read_once(scenario), 1)
    try:
        record = next(iter(measure_models(session.person, session.job)))
    except OperatorGaveUp as error:
        return session.person, None, str(error)
    return session.person, record, ""


@pytest.mark.parametrize(
    ("kind", "form", "point"),
    [
        ("gross", "model coordinates", "C1"),
        ("gross", "relative orientation", "1011"),
        ("transposed digits", "left perspective centre", "1011"),
        ("transposed digits", "model coordinates", "1d"),
        ("wrong sign", "relative orientation", "1013"),
    ],
)
def test_a_wrong_reading_stands_in_the_book_where_it_was_planted_and_is_struck_out(kind, form, point):
    person, record, _ = planted(kind, form=form, point=point)
    (slip,) = person.slips
    entry = person.book.entries[slip.entry - 1]
    assert (slip.kind, slip.model, slip.form, slip.point) == (kind, "1", form, point)
    assert (entry.model, entry.form, entry.point) == ("1", form, point)
    assert (entry.item, entry.reading) == (slip.item, slip.written)
    assert slip.written != slip.right
    assert entry.struck
    assert record.orientation.rms < 0.03


def test_a_last_digit_is_too_small_to_be_noticed_and_stays():
    person, record, _ = planted("last digit", form="relative orientation", point="1011")
    (slip,) = person.slips
    assert float(slip.written) - float(slip.right) == pytest.approx(0.01)
    assert person.book.entries[slip.entry - 1].struck == ""
    assert record.orientation.rms < 0.03


def test_a_wrong_point_among_the_model_coordinates_is_not_noticed_and_comes_out_wrong():
    """Both pointings agree, on the neighbour."""
    person, record, _ = planted("wrong point", form="model coordinates", point="1d")
    (slip,) = person.slips
    assert (slip.written, slip.right) == ("1d", "1a")
    assert np.hypot(*np.subtract(record.points["1d"], record.points[slip.right])[:2]) < 0.05
    book = [e for e in person.book.entries if e.form == "model coordinates" and e.point == "1d" and e.item == "X"]
    assert [float(e.reading) for e in book] == pytest.approx([record.points[slip.right][0]] * len(book), abs=0.1)


def test_a_wrong_point_at_one_level_of_a_centre_does_not_meet_the_others_and_is_struck_out():
    person, record, _ = planted("wrong point", form="left perspective centre", point="1011")
    (slip,) = person.slips
    assert "two levels" in person.book.entries[slip.entry - 1].struck
    assert record.centres[1].rms < 0.5


def test_a_wrong_point_for_a_parallax_does_no_harm():
    """A parallax is as good at a neighbour as at the point, since its place is read as well."""
    person, record, _ = planted("wrong point", form="relative orientation", point="1011")
    assert [slip.kind for slip in person.slips] == ["wrong point"]
    assert record.orientation.rms < 0.03


LEVERS = {
    "dove": "Dove prisms had been forgotten: put outside",
    "triangulation": "triangulation lever had been forgotten: put back",
    "diapositive": "diapositive lever had been forgotten: put left",
    "xcollar": "collar of the X wheel had been forgotten: put in",
    "ycollar": "collar of the Y wheel had been forgotten: put out",
}


@pytest.mark.parametrize("lever", list(LEVERS))
def test_a_forgotten_lever_is_detected_in_the_view_and_corrected(lever):
    """It costs some time, and the model comes out as without it."""
    person, record, _ = planted("forgotten lever", point=lever)
    (slip,) = person.slips
    assert (slip.form, slip.point) == ("interior orientation", lever)
    assert person.book.remarks == [f"1: the {LEVERS[lever]}"]
    _, faultless, _ = planted("forgotten lever", point="nowhere")
    assert 20.0 < record.finished_at - faultless.finished_at < 2500.0
    assert record.orientation.rms < 0.03
    for name in ("kappa1", "kappa2", "phi1", "phi2", "omega1"):
        assert record.orientation.elements[name] == pytest.approx(faultless.orientation.elements[name], abs=0.021)


@pytest.mark.parametrize(
    ("levers", "procedure"),
    [
        (("xcollar", "diapositive"), "numerical"),
        (("xcollar", "diapositive"), "empirical"),
        (("dove", "ycollar", "triangulation"), "numerical"),
    ],
)
def test_wrong_levers_that_compensate_each_other_are_all_found(levers, procedure):
    """A mirrored picture and a wheel that turns the wrong way agree with each other, but not in both eyes."""
    slips = [PlannedSlip(kind="forgotten lever", point=lever) for lever in levers]
    observer = msgspec.structs.replace(Observer(**WITHOUT_SLIPS), certain_slips=slips)
    scenario = one_model(observer)
    plan = msgspec.structs.replace(scenario.plan, procedure=procedure)
    session = open_session(read_once(msgspec.structs.replace(scenario, plotting=plan)), 1)
    record = next(iter(measure_models(session.person, session.job)))
    found = [remark for remark in session.person.book.remarks if "forgotten" in remark]
    assert sorted(found) == sorted(f"1: the {LEVERS[lever]}" for lever in levers)
    assert record.orientation.rms < 0.03


def test_an_element_not_reread_is_set_from_the_reading_before_and_leaves_the_model_worse():
    person, record, _ = planted("element not re-read", point="kappa2")
    (slip,) = person.slips
    assert (slip.round, slip.written) == (2, "0.00")
    entry = person.book.entries[slip.entry - 1]
    assert (entry.round, entry.item) == (2, "set kappa2")
    assert abs((float(entry.reading) + 200.0) % 400.0 - 200.0) < 0.1
    _, faultless, _ = planted("gross", point="nowhere")
    assert record.orientation.rms > 2.0 * faultless.orientation.rms
    assert record.orientation.rounds[-1].rms > 1.0


def test_a_planted_slip_happens_once_and_one_that_fits_nowhere_not_at_all():
    assert planted("gross", point="nowhere")[0].slips == []
    assert len(planted("transposed digits")[0].slips) == 1


def test_slips_are_in_the_results_and_in_no_entry_of_book_or_journal(tmp_path):
    slip = PlannedSlip(kind="transposed digits", form="model coordinates", point="C1")
    observer = msgspec.structs.replace(Observer(**WITHOUT_SLIPS), certain_slips=[slip])
    document = run(read_once(one_model(observer)), 1, RunOptions(tmp_path / "out"))
    (slip,) = document["truth"]["slips"]
    assert (slip["kind"], slip["form"], slip["point"]) == ("transposed digits", "model coordinates", "C1")
    assert slip["struck"]
    assert json.loads((tmp_path / "out" / "results.json").read_text())["truth"]["slips"] == [slip]
    for file in ("book.csv", "session.jsonl"):
        text = (tmp_path / "out" / file).read_text()
        assert not any(word in text for word in ("transposed", "slip", "planted"))
    hours = document["operator"]["time_by_activity_h"]
    assert sum(hours.values()) == pytest.approx(document["operator"]["hours"], abs=1e-3)
    assert sum(document["operator"]["time_by_act_h"].values()) == pytest.approx(sum(hours.values()), abs=1e-3)


def test_the_frequency_of_drawn_slips_equals_their_rates():
    """Four operators write a thousand readings of by each, with a rate of 5 % of either kind."""
    slipping = Observer(**WITHOUT_SLIPS | {"wrong_sign_rate": 0.05, "transposed_rate": 0.05})
    operators = open_batch(one_model(slipping), range(4)).workstation.operators
    active, nothing = operators.active, np.zeros(4)
    for _ in range(1000):
        operators.transcribe(active, "1", "by1", np.full(4, 3.12), nothing)
    for kind in ("wrong sign", "transposed digits"):
        assert sum(slip.kind == kind for log in operators.slip_log for slip in log) == pytest.approx(200, abs=45)
    written = {slip.written for log in operators.slip_log for slip in log}
    assert written == {"-3.12", "3.21"}


def test_random_misreadings_are_logged_as_slips():
    session = open_session(one_model(Observer(blunder_rate=0.05)), 1)
    person = session.person
    next(iter(measure_models(person, session.job)))
    assert {slip.kind for slip in person.slips} == {"gross", "last digit"}
    for slip in person.slips:
        if slip.entry:
            assert person.book.entries[slip.entry - 1].reading == slip.written


def test_transposed_digits_are_neighbours_and_plausible():
    assert transpositions(49.12) == [49.21]
    assert transpositions(-0.13) == [-0.31]
    assert transpositions(5047.36) == [5047.63]
    assert transpositions(4956.33) == [4965.33]
    assert transpositions(11.11) == []


def test_the_neighbours_of_a_standard_point_are_those_beside_it():
    points = {position: f"P{position}" for position in "123456abcdefghi"}
    assert neighbours(points, "Pd") == ["Pa", "Pg"]
    assert neighbours(points, "P3") == ["Pa", "Pd"]
    assert neighbours(points, "C1") == []
