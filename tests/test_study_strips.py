"""A study that replicates the thesis: every case of both models measured once, twenty-five strips, claims tested."""

import msgspec
import numpy as np
import pytest

from a7sim.errors import A7SimError
from a7sim.report.drawing import standalone
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene
from a7sim.session.all_methods import measure_all_methods_batch
from a7sim.session.combination_batch import combine_strips
from a7sim.session.strip_combinations import combinations
from a7sim.standard_points import CASES
from a7sim.strip_methods.strip import ground_control, orient_strip, oriented_strip_document
from a7sim.study import claims
from a7sim.study import figures as figures_of_study
from a7sim.study.cells import Cell
from a7sim.study.checkpoint import save
from a7sim.study.executors import open_executor
from a7sim.study.findings import findings_document
from a7sim.study.loading import build_study, load_study
from a7sim.study.page import study_markdown, study_page
from a7sim.study.running import ChunkPolicy, run_study
from a7sim.study.schema import Hypothesis
from a7sim.study.simulating import Task, replicate_seed
from a7sim.study.tally import Tally

STUDY = {
    "schema_version": 1,
    "title": "The thesis",
    "question": "Does it matter?",
    "scenario": "akwanga",
    "strips": "all",
    "settings": {"plan.parallax_readings": 1},
    "responses": ["strip_plan_at_checks_m", "rotation_error_gon@1", "centre_Z_error", "hours"],
    "claim": [
        {
            "says": "Density matters.",
            "about": "density",
            "factor": "model 1",
            "differ": [["A"], ["E"]],
            "responses": ["rotation_error_gon@1"],
        },
        {
            "says": "Centres matter.",
            "about": "the centres",
            "depends_on": ["centre_Z_error"],
            "responses": ["strip_plan_at_checks_m"],
        },
    ],
    "replicates": 3,
    "seed": 3,
}


def laid(tmp_path, **changes):
    return build_study(STUDY | changes, tmp_path)


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("akwanga", settings=STUDY["settings"])


SEEDS = [replicate_seed(STUDY["seed"], each) for each in range(3)]


@pytest.fixture(scope="module")
def task_results(tmp_path_factory):
    """Return the numbers of three replicates from the study's task, and its sessions by case."""
    (task,) = laid(tmp_path_factory.mktemp("asked")).tasks
    by_case = {}

    def kept(scenario, *arguments, **options):
        by_case[scenario.plan.case] = measure_all_methods_batch(scenario, *arguments, **options)
        return by_case[scenario.plan.case]

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("a7sim.study.simulating.measure_all_methods_batch", kept)
        return task.run_batch(SEEDS), by_case


@pytest.fixture(scope="module")
def replicates(task_results):
    """Sessions of three replicates in every case; in the second case D gave up."""
    _, by_case = task_results
    gave_up = {"status": "does not fit", "message": "said in the test", "models": ()}
    return [
        {
            case: msgspec.structs.replace(each[i], **gave_up) if (i, case) == (1, "D") else each[i]
            for case, each in by_case.items()
        }
        for i in range(3)
    ]


@pytest.fixture(scope="module")
def ground(scenario):
    return ground_control(scenario, build_scene(scenario, 1))


def test_strips_on_arrays_equal_those_of_single_orientations(scenario, replicates, ground):
    """All twenty-five agree with `orient_strip` to a hundredth of a micron, far below the 0.1 mm printed."""
    by_case = {case: each.strip_models for case, each in replicates[0].items()}
    (documents,) = combine_strips(replicates[:1], 2, ground, scenario.strip)
    assert len(documents) == 25
    for combination, document in zip(combinations(by_case), documents, strict=True):
        expected = oriented_strip_document(orient_strip(combination.models, ground))
        strip = document["strip"]
        assert strip["joins"][0]["max_residual_mm"] == pytest.approx(expected["joins"][0]["max_residual_mm"], abs=1e-8)
        for on in ("control", "checks"):
            assert strip["accuracy_m"][on] == {
                key: pytest.approx(expected["accuracy_m"][on][key], abs=1e-8) for key in ("rms", "plan", "height")
            }


def test_no_bit_of_a_strip_depends_on_the_other_replicates(scenario, replicates, ground):
    together = list(combine_strips(replicates, 2, ground, scenario.strip))
    assert together == [strips for each in replicates for strips in combine_strips([each], 2, ground, scenario.strip)]


def test_a_session_that_gave_up_removes_only_its_own_strips(scenario, replicates, ground):
    _, of_second, *_ = combine_strips(replicates, 2, ground, scenario.strip)
    statuses = [document["status"] for document in of_second]
    assert statuses.count("does not fit") == 9
    assert statuses[0] == statuses[-1] == "complete"
    assert of_second[3]["message"] == "said in the test"


def test_hours_of_a_strip_of_one_case_equal_those_of_its_session(scenario, replicates, ground):
    for number, case in ((0, "A"), (12, "C"), (24, "E")):
        hours = next(combine_strips(replicates[:1], 2, ground, scenario.strip))[number]["operator"]["hours"]
        assert hours == pytest.approx(replicates[0][case].operator["hours"], abs=1e-3)


@pytest.fixture(scope="module")
def study_and_tally(tmp_path_factory):
    """Return a study and a tally of numbers that its sessions could give."""
    study = laid(tmp_path_factory.mktemp("study"), replicates=30)
    tally = Tally.empty(25, 4)
    rng = np.random.default_rng(2)
    centres, of_models = rng.gamma(9.0, 0.1, (25, 30)), np.repeat(rng.gamma(9.0, 0.001, (5, 1, 30)), 5, axis=1)
    for cell in range(25):
        plan = 0.05 + 0.02 * centres[cell] + rng.normal(0.0, 0.01, 30)
        tally.add(cell, np.array([plan, of_models.reshape(25, 30)[cell], centres[cell], rng.normal(9.0, 0.4, 30)]))
    return study, tally


def test_each_cell_is_a_strip_and_a_model_does_not_depend_on_its_partner(tmp_path, monkeypatch, replicates, ground):
    """One task gives the numbers of all cells, in the order of the thesis."""
    study = laid(tmp_path)
    (task,) = study.tasks
    by_case = {case: [each[case] for each in replicates] for case in CASES}
    monkeypatch.setattr(
        "a7sim.study.simulating.measure_all_methods_batch", lambda scenario, *_, **__: by_case[scenario.plan.case]
    )
    values = task.run_batch([1, 2, 3])
    assert [cell.label for cell in study.cells][:2] == ["model 1 A, model 2 A", "model 1 A, model 2 B"]
    rotation = values[:, 1, 0].reshape(5, 5)
    assert (rotation == rotation[:, :1]).all()
    assert len(np.unique(rotation)) == 5
    assert np.isnan(values[:, :, 1]).all(axis=1).sum() == 9
    assert (task.cells, study.task_of(8)) == (25, (task, 8))


def test_one_cell_needs_only_the_sessions_of_its_cases(tmp_path, monkeypatch, scenario, replicates, ground):
    """An audit runs only these, with both drivers, and its strips equal those of the study to the last bit."""
    (task,) = laid(tmp_path).tasks
    worked_cases = []

    def measured_before(scenario, *_, **__):
        worked_cases.append(scenario.plan.case)
        return [replicates[0][scenario.plan.case], replicates[2][scenario.plan.case]]

    monkeypatch.setattr("a7sim.study.simulating.measure_all_methods_batch", measured_before)
    whole = list(combine_strips([replicates[0], replicates[2]], 2, ground, scenario.strip))
    for cell, cases in ((8, ["B", "D"]), (15, ["D", "A"]), (12, ["C"])):
        assert task.batch_documents(cell, SEEDS[::2]) == [each[cell] for each in whole]
        assert worked_cases == cases
        worked_cases.clear()


def test_a_task_interrupted_between_its_cells_resumes_to_the_same_numbers(tmp_path, monkeypatch):
    """Some of the cells that share a session may have been added and others not; chunks do not matter."""

    def numbers(_, seeds):
        return np.sin(np.arange(25.0)[:, None, None] + np.arange(4.0)[None, :, None] + np.array(seeds, dtype=float))

    monkeypatch.setattr(Task, "run_batch", numbers)
    study = laid(tmp_path, replicates=9)
    whole = _numbers(study, 9)
    begun = Tally.empty(25, 4)
    for cell in range(25):
        begun.add(cell, whole.sample(cell)[:, : 5 if cell < 7 else 2])
    again = _numbers(study, 2, begun)
    for tally, name in ((whole, "whole.npz"), (again, "again.npz")):
        save(tally, tmp_path / name, study.identity)
    assert (tmp_path / "again.npz").read_bytes() == (tmp_path / "whole.npz").read_bytes()


def _numbers(study, largest_chunk, tally=None):
    tally = tally or Tally.empty(len(study.cells), len(study.responses))
    with open_executor("process") as (executor, at_once):
        run_study(study, tally, executor, at_once, pace=ChunkPolicy(largest_chunk=largest_chunk))
    return tally


@pytest.mark.slow
def test_a_strip_over_the_link_gives_the_same_digits(tmp_path, task_results):
    """A selected strip equals that of the sessions of its two cases over the link, to the last digit stored."""
    task, cell = laid(tmp_path).task_of(8)
    numbers, _ = task_results
    assert task.run_single(cell, SEEDS[1]).tolist() == numbers[cell, :, 1].tolist()


@pytest.fixture(scope="module")
def document(study_and_tally):
    return findings_document(*study_and_tally)


def test_claims_have_answers_in_words_and_in_one_sentence(document):
    for claim, about in zip(document["claims"], ("density", "the centres"), strict=True):
        assert claim["short"].startswith(f"{about} {claim['verdict']} (")
        assert claim["short"].lower() in document["in_a_sentence"].lower()
    assert "E minus A" in document["claims"][0]["answer"][0]


def test_a_factor_that_does_not_affect_a_response_has_no_variance(document):
    analysis = next(each for each in document["variance"] if each["response"] == "rotation_error_gon@1")
    assert [each["squares"] > 0.0 for each in analysis["sources"][:3]] == [True, False, False]


def test_the_page_has_the_map_of_the_combinations_and_loads_nothing_from_the_network(document):
    page = study_page(document)
    for words in ("Claim: Density matters.", "Strip plan at checks (m) by model 1 and model 2", "densities by model 1"):
        assert words in page
    assert "http" not in page.replace("http://www.w3.org", "")


def test_the_markdown_names_every_figure_file_and_figures_are_self_contained(document):
    text, figures = study_markdown(document, "../figures/the-")
    assert {"map-strip-plan-at-checks-m.svg", "claims-effect.svg", "claims-correlation.svg"} <= set(figures)
    for name, svg in figures.items():
        assert f"](../figures/the-{name})" in text
        assert "var(--" not in svg
        assert svg.startswith('<svg xmlns="http://www.w3.org/2000/svg"')
    again = figures_of_study.heat_map(document, document["responses"][0])
    assert standalone(again)[1] == figures["map-strip-plan-at-checks-m.svg"]


@pytest.mark.parametrize(
    ("shift", "replicates", "verdict"),
    [(0.5, 400, claims.MATTERS), (0.0, 4000, claims.NOTHING), (0.0, 20, claims.OPEN)],
)
def test_the_verdict_of_a_claim_follows_from_effect_and_interval(shift, replicates, verdict):
    """An effect not detected with twenty replicates is left open; only a narrow interval shows that there is none."""
    rng = np.random.default_rng(1)
    values = rng.normal(10.0, 1.0, (3, replicates)) + np.array([0.0, 0.0, shift])[:, None]
    cells = [Cell(number, {"f": level}, {}) for number, level in enumerate("ABC", start=1)]
    claim = Hypothesis(says="s", about="it", factor="f", alike=["A", "B", "C"], responses=["hours"])
    responses = {"hours": {"name": "hours", "unit": "h", "meaning": "hours"}}
    (found,) = claims.test_claims([claim], cells, responses, lambda _: values)
    assert found["verdict"] == verdict
    assert len(found["tests"]) == 3


MISTAKES = {
    "a case among the settings": ({"settings": {"plan.case": "B"}}, "without plan.case"),
    "another bench": ({"settings": {"work": ["plotter", "comparator"]}}, "work at the plotter alone"),
    "a wrong factor": ({"claim": [STUDY["claim"][0] | {"factor": "model 3"}]}, "a factor of model 1, model 2"),
    "a wrong level": ({"claim": [STUDY["claim"][0] | {"differ": [["A"], ["F"]]}]}, "a level of A, B, C, D, E"),
    "a level against itself": (
        {"claim": [STUDY["claim"][0] | {"differ": [["A"], ["B", "A"]]}]},
        "claim 1: expected every level once, got 'A' twice",
    ),
    "a level against none": (
        {"claim": [STUDY["claim"][0] | {"differ": [["A"], []]}]},
        "a level or more in both groups of differ",
    ),
    "a wrong response": ({"claim": [STUDY["claim"][1] | {"depends_on": ["iterations"]}]}, "claim 1: expected a respon"),
    "two kinds": ({"claim": [STUDY["claim"][0] | {"alike": ["B", "C"]}]}, "got differ and alike"),
    "a strip in one model": ({"responses": ["hours@1"]}, "a response of models before @"),
}


@pytest.mark.parametrize("name", list(MISTAKES))
def test_the_error_message_for_a_mistake_is_one_sentence(tmp_path, name):
    changes, words = MISTAKES[name]
    with pytest.raises(A7SimError) as raised:
        laid(tmp_path, **({"claim": []} | changes))
    assert words in str(raised.value)
    assert len(str(raised.value).splitlines()) == 1


def test_the_thesis_has_twenty_five_cells_and_its_own_claims():
    study = load_study("thesis-1985")
    assert (len(study.cells), len(study.tasks), study.replicates) == (25, 1, 10_000)
    assert len(study.study.claim) == 4
