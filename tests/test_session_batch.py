"""One procedure, two drivers: a batch of sessions gives the digits of each session over its link."""

import msgspec
import pytest

from a7sim.operator import OperatorGaveUp, measure_models
from a7sim.scenario import load_scenario
from a7sim.scenario.schema import Condition, ProjectorCondition
from a7sim.session import open_session, run
from a7sim.session.session_batch import BatchDriver, open_batch
from tests.support.sessions import read_once, tilted_flight, without_errors

SEEDS = (1985, 7)
OUT_OF_TRUE = Condition(
    left=ProjectorCondition(phi_zero_gon=0.03, principal_point_um=(12.0, -7.0), axes_um=(20.0, -30.0, 15.0)),
    right=ProjectorCondition(omega_zero_gon=-0.02, principal_distance_mm=0.02, by_zero_mm=0.05),
    bx_zero_mm=0.03,
    carriage_scale_ppm=(40.0, -30.0, 20.0),
    carriage_skew_ppm=(15.0, 0.0, -10.0),
)


def same_to_the_digit(scenario, seeds=SEEDS, all_finish=False, looked_at=None):
    """Return whether every number read or set is the same over the link and in the batch.

    Compared are all sessions of the batch, or only those with the seeds `looked_at`.
    """
    batch, same = same_as_alone(scenario, seeds, looked_at or seeds)
    if all_finish:
        assert batch.workstation.operators.reasons == {}
    return same


def same_as_alone(scenario, seeds, looked_at):
    """Return a batch that has run and whether its sessions `looked_at` give the digits of single sessions."""
    batch = open_batch(scenario, seeds)
    records = list(batch.measure_models())
    if not batch.workstation.operators.reasons:
        assert [each.model.name for each in records] == [each.name for each in scenario.models]
    return batch, all(_same(batch, records, seeds.index(seed), seed) for seed in looked_at)


def _same(batch, records, session, seed):
    alone = open_session(batch.scenario, seed)
    done, why = [], None
    try:
        for record in measure_models(alone.person, alone.job):
            done.append(record)
    except OperatorGaveUp as error:
        why = str(error)
    among_others = [each.for_session(session) for each in records if session in each.sessions]
    return (
        batch.workstation.operators.reasons.get(session) == why
        and [read_and_set(each) for each in done] == [read_and_set(each) for each in among_others]
        and all(
            computed(one) == pytest.approx(computed(other), abs=1e-6)
            for one, other in zip(done, among_others, strict=True)
        )
    )


def read_and_set(record):
    """Return the readings of counters and the time."""
    set_in_rounds = [each.settings for each in record.orientation.rounds]
    principal_distances = [each.principal_distance for each in record.interior.values()]
    return record.orientation.elements, set_in_rounds, principal_distances, record.points, record.finished_at


def computed(record):
    """Return numbers computed from readings: they differ at most in the last bits of a sum."""
    centres = [getattr(record.centres[hand], name) for hand in (1, 2) for name in ("X0", "Y0", "Z0", "T0", "rms")]
    rounds = [value for each in record.orientation.rounds for value in (each.mean, each.rms, *each.sigmas.values())]
    residuals = list(record.orientation.residuals.values())
    return [*map(float, centres), *rounds, *residuals, *(each.residual_mm for each in record.interior.values())]


SCENARIOS = {
    "as it stands": load_scenario("akwanga"),
    "dependent, case D": load_scenario("akwanga", {"plan.method": '"dependent"', "plan.case": '"D"'}),
    "no errors at all": without_errors(load_scenario("akwanga")),
    "five gon of tilt": tilted_flight([(5.0, -2.0, 3.0), (1.0, 3.0, 5.0), (-3.0, -2.0, -5.0)]),
    "many slips": load_scenario("akwanga", {"observer.blunder_rate": "0.05", "observer.last_digit_slip": "0.05"}),
    "forgotten levers": load_scenario("akwanga", {"observer.forgotten_lever_rate": "0.4"}),
    "out of true": load_scenario("akwanga"),
    "play and setting errors": load_scenario(
        "akwanga",
        {
            "instrument.condition.backlash_gon": "0.02",
            "instrument.condition.setting_sigma_mm": "0.01",
            "instrument.condition.carriage_backlash_mm": "0.01",
        },
    ),
    "a serviced instrument": load_scenario("akwanga", {"instrument.condition": '"serviced"'}),
    "a worn instrument": load_scenario(
        "akwanga",
        {
            "instrument.condition.upkeep": '"worn"',
            "instrument.condition.counter_slip_share": "0.0003",
            "plan.tolerated_centre_rms": "100.0",
            "plan.tolerated_parallax_um": "200.0",
        },
    ),
    "empirical, swing-swing": load_scenario("akwanga", {"plan.procedure": '"empirical"', "plan.start_off_gon": "1.0"}),
    "empirical, one projector": load_scenario(
        "akwanga", {"plan.procedure": '"empirical"', "plan.method": '"dependent"'}
    ),
    "levelled and scaled at the instrument": load_scenario("akwanga", {"plan.absolute_orientation": "true"}),
    "centres by grid plate": load_scenario("akwanga", {"plan.centre_method": '"grid plate"'}),
    "a real pair": load_scenario("dewitt-pair"),
}


BOTH_MODELS = ("as it stands",)
"""Scenarios with both models; the others have only their first model."""

READ_AGAIN = ("many slips",)
"""Scenarios whose parallaxes are read three times; in the others they are read once."""


@pytest.mark.parametrize("name", list(SCENARIOS))
def test_a_batch_gives_the_same_digits_as_each_session_over_the_link(name):
    scenario = SCENARIOS[name]
    if name == "out of true":
        instrument = msgspec.structs.replace(scenario.instrument, condition=OUT_OF_TRUE)
        scenario = msgspec.structs.replace(scenario, instrument=instrument)
    if name not in READ_AGAIN:
        scenario = read_once(scenario)
    if name not in BOTH_MODELS:
        scenario = msgspec.structs.replace(scenario, models=scenario.models[:1])
    assert same_to_the_digit(scenario, all_finish=True, looked_at=SEEDS if name == "as it stands" else SEEDS[1:])


def test_a_batch_driver_that_is_off_by_one_count_is_detected(monkeypatch):
    """The comparison can fail: a counter of the batch that shows one hundredth more gives other numbers."""
    true_method = BatchDriver.elements

    def one_count_more(self, active, names):
        return {name: counts + 0.01 * (name == "by1") for name, counts in true_method(self, active, names).items()}

    monkeypatch.setattr(BatchDriver, "elements", one_count_more)
    scenario = read_once(SCENARIOS["as it stands"])
    assert not same_to_the_digit(msgspec.structs.replace(scenario, models=scenario.models[:1]), SEEDS[:1])


@pytest.fixture(scope="module")
def batch_of_one():
    """Return the document of a batch of one session, with seed 3."""
    (document,) = open_batch(read_once(SCENARIOS["as it stands"]), [3]).run()
    return document


def test_the_document_of_a_batch_equals_that_of_a_run_without_its_link(batch_of_one):
    document = batch_of_one
    alone = run(read_once(SCENARIOS["as it stands"]), 3)
    assert document["models"] == alone["models"]
    assert document["status"] == "complete"
    assert document["strip"] == alone["strip"]
    assert document["operator"].items() <= alone["operator"].items()


@pytest.mark.parametrize(
    ("setting", "value"),
    [("photos.1.laid", '"upside down"'), ("plan.tolerated_parallax_um", "0.01")],
)
def test_an_operator_that_gives_up_has_a_reason_and_becomes_inactive(setting, value):
    batch, same = same_as_alone(read_once(load_scenario("akwanga", {setting: value})), SEEDS, SEEDS)
    assert same
    assert set(batch.workstation.operators.reasons) == {0, 1}


def test_a_session_does_not_depend_on_the_other_sessions_of_its_batch(batch_of_one):
    """A session gives the same numbers in every batch, also beside a session that gives up."""
    scenario = read_once(SCENARIOS["as it stands"])
    strict = msgspec.structs.replace(
        scenario, plotting=msgspec.structs.replace(scenario.plan, tolerated_centre_rms=0.19)
    )
    given_up, among_others, *_ = open_batch(strict, [14, 3, 11]).run()
    assert given_up["status"] == "does not fit"
    assert batch_of_one == among_others
