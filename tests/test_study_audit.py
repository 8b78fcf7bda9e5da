"""The audit detects a batch driver that is off by one least count anywhere."""

import numpy as np
import pytest

from a7sim.session.batch_driver import BatchDriver
from a7sim.study import simulating
from a7sim.study.auditing import audit_study
from a7sim.study.executors import InProcess
from a7sim.study.loading import build_study
from a7sim.study.running import run_study
from a7sim.study.simulating import Task, replicate_seed
from a7sim.study.tally import Tally

AT_THE_PLOTTER = {
    "schema_version": 1,
    "title": "As it stands",
    "question": "How long does a model take?",
    "scenario": "akwanga",
    "replicates": 1,
    "responses": ["hours"],
    "settings": {"models": [{"name": "1", "left": "101", "right": "102"}], "plan.parallax_readings": 1},
}


@pytest.fixture(scope="module")
def run_once(tmp_path_factory):
    """Return a study of one session and its tally by the correct batch driver; the run over the link is cached."""
    loaded = build_study(AT_THE_PLOTTER, tmp_path_factory.mktemp("study"))
    tally = Tally.empty(1, 1)
    run_study(loaded, tally, InProcess())
    linked = loaded.tasks[0].link_document(0, replicate_seed(loaded.study.seed, 0))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Task, "link_document", lambda task, cell, seed: linked)
        yield loaded, tally


def test_the_correct_batch_driver_passes(run_once):
    assert audit_study(*run_once, 1) == []


def _reads(name, off):
    """Return a method that adds `off` to a reading of an element, of a counter axis or to its only value."""

    def perturbed(true_method):
        def method(self, active, *arguments):
            found = true_method(self, active, *arguments)
            if isinstance(found, dict):
                return {each: value + off * (each == name) for each, value in found.items()}
            return found + off * (name in arguments)

        return method

    return perturbed


def _moves(off, *names):
    def perturbed(true_method):
        def method(self, active, element, values):
            true_method(self, active, element, values + off * (element in names))

        return method

    return perturbed


def _gives(off):
    return lambda true_method: lambda self, active, *arguments: true_method(self, active, *arguments) + off


PERTURBED = {
    "an element read": ("elements", _reads("by1", 0.01)),
    "an element turned": ("turn_element", _moves(0.01, "by1", "by2")),
    "an element set": ("set_element", _moves(0.01, "bx")),
    "X of model and centres": ("counter", _reads("X", 0.01)),
    "Y of model and centres": ("counter", _reads("Y", 0.01)),
    "Z of model and centres": ("counter", _reads("Z", 0.01)),
    "the picture in the eyepiece": ("view_point", _gives(0.01)),
}


@pytest.mark.parametrize("name", list(PERTURBED))
def test_one_least_count_too_much_anywhere_in_the_batch_driver_is_detected(run_once, monkeypatch, name):
    method, perturbed = PERTURBED[name]
    monkeypatch.setattr(BatchDriver, method, perturbed(getattr(BatchDriver, method)))
    (found,) = audit_study(*run_once, 1)
    assert (found.cell, found.replicate) == (1, 1)


def test_a_strip_of_the_batch_that_is_off_by_a_millimetre_is_detected(run_once, monkeypatch):
    true_method = simulating.run_all_methods_batch

    def a_millimetre_off(*arguments, **options):
        documents = true_method(*arguments, **options)
        for document in documents:
            document["strip"]["residuals_m"]["C1"]["X"] += 0.001
        return documents

    monkeypatch.setattr(simulating, "run_all_methods_batch", a_millimetre_off)
    (found,) = audit_study(*run_once, 1)
    assert (found.place, found.others) == ("strip.residuals_m.C1.X", 0)


def test_a_changed_response_of_the_study_is_detected(run_once):
    loaded_study, _ = run_once
    other = Tally.empty(1, 1)
    other.add(0, np.array([[1.0]]))
    (found,) = audit_study(loaded_study, other, 1)
    assert (found.place, found.batch_value, found.others) == ("hours", 1.0, 0)
