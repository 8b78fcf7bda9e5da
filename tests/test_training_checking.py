"""`a7sim train check` of wrong exercises: one sentence for each fault, with its place and the expected value."""

import shutil

import pytest
from msgspec.structs import replace as changed

from a7sim.training import checking, template
from a7sim.training.catalogue import find_exercise, read_exercise
from a7sim.training.checking import check_exercise
from a7sim.training.exercise import ChecklistItem, ExerciseFolder, FaultyRun, PlayedRun


@pytest.fixture(scope="module")
def parallax():
    return find_exercise("4")


def wrong(exercise_folder, **changes):
    return changed(exercise_folder, exercise=changed(exercise_folder.exercise, **changes))


def faults_of(exercise_folder):
    found = check_exercise(exercise_folder)
    assert all("\n" not in fault and "expected " in fault for fault in found.faults)
    return found.faults


def test_all_faults_of_form_are_reported_together_before_any_run(parallax, tmp_path):
    first, *others = parallax.exercise.criteria
    bare = wrong(
        ExerciseFolder(parallax.exercise, tmp_path),
        hints=parallax.exercise.hints[:1],
        faulty=[],
        steps=[],
        criteria=[changed(first, weight=first.weight + 5.0), *others],
        opening=None,
    )
    found = check_exercise(bare)
    assert found.reference_points is None
    assert found.faults == (
        "text.md: expected the exercise in plain words, found none",
        "hint: expected 2 hints or more, got 1",
        "faulty: expected 2 faulty runs or more, got 0",
        "step: expected a checklist, got no step",
        "criterion: expected weights that add up to 100, got 105",
        "reference.a7s: expected a script beside the exercise, found none",
    )


def test_an_exercise_that_every_run_passes_is_detected(parallax):
    """No criterion and no points are required: the reference as a faulty run and a run without actions both pass."""
    exercise = parallax.exercise
    by2_left = next(each for each in exercise.faulty if each.script == "faulty-by2-left.a7s")
    lenient = wrong(
        parallax,
        pass_points=0.0,
        criteria=[changed(each, required=False) for each in exercise.criteria],
        faulty=[
            FaultyRun(script="reference.a7s", fails="at-rest", why="it does not"),
            changed(by2_left, fails="complete"),
        ],
        steps=[
            changed(exercise.steps[0], text="never", done=-1.0),
            ChecklistItem(
                text="already", measure=exercise.steps[0].measure, options=exercise.steps[0].options, done=1000.0
            ),
        ],
    )
    faults = faults_of(lenient)
    for sentence in (
        "reference.a7s: expected it to fail, got 100 points",
        "reference.a7s: expected at-rest to fail, got nothing",
        "faulty-by2-left.a7s: expected complete to fail, got at-rest",
        "expected a run without actions not to pass, got a pass",
        "step 'never': expected the reference to tick it, got ",
        "step 'already': expected an open item after the opening, got it ticked",
    ):
        assert any(fault.startswith(sentence) for fault in faults), (sentence, faults)


def test_limits_below_the_accuracy_of_the_eye_and_reversed_bands_are_detected(parallax, tmp_path):
    """Both are detected before any run; the last fault is that the reference cannot finish."""
    folder = tmp_path / "04-parallax"
    shutil.copytree(parallax.folder, folder)
    lines = (folder / "reference.a7s").read_text(encoding="utf-8").splitlines()
    (folder / "reference.a7s").write_text("\n".join([*lines[:1], "> COUNter?", "< nonsense"]) + "\n", encoding="utf-8")
    limits = {"cleared": (1e-3, 2e-3), "on-the-ground": (50.0, 40.0)}
    criteria = [
        changed(each, excellent=limits[each.id][0], passing=limits[each.id][1]) if each.id in limits else each
        for each in parallax.exercise.criteria
    ]
    faults = faults_of(wrong(ExerciseFolder(parallax.exercise, folder), criteria=criteria))
    assert len(faults) == 4
    for fault, band in zip(faults[:2], ("excellent", "pass"), strict=True):
        assert fault.startswith(f"cleared: expected {band} not below the accuracy of eye and least count, ")
    assert faults[2] == "on-the-ground: expected excellent at least as strict as pass, got excellent 50 and pass 40"
    assert faults[3].startswith("reference: expected it to finish: ")


def test_a_reference_that_fails_is_reported_with_the_failed_criterion(parallax):
    (fault, *_) = faults_of(wrong(parallax, reference=PlayedRun(script="faulty-half.a7s"), faulty=[]))[1:]
    assert fault.startswith("reference: expected it to pass, got complete: ")


def test_remaining_text_of_the_template_is_reported(parallax):
    first, *others = parallax.exercise.criteria
    unfinished = wrong(
        parallax,
        goal=template.GOAL,
        criteria=[changed(first, feedback=template.FEEDBACK), *others],
        hints=[changed(parallax.exercise.hints[0], text=template.HINT), *parallax.exercise.hints[1:]],
    )
    faults = list(checking._template_text(unfinished))
    assert [fault.partition(": expected")[0] for fault in faults] == ["goal", f"{first.id}: feedback", "hint 1"]
    assert list(checking._template_text(parallax)) == []


def test_a_new_template_is_rejected_for_its_own_text(tmp_path):
    folder = template.write_template(tmp_path / "20-clouds", 20)
    faults = list(checking._template_text(read_exercise(folder)))
    places = {fault.partition(": expected")[0] for fault in faults}
    assert places == {"goal", "complete: feedback", "pointed: feedback", "hint 1", "text.md", "reference.a7s"}


def test_unused_files_are_reported_and_included_ones_are_not(parallax, tmp_path):
    folder = tmp_path / "04-parallax"
    shutil.copytree(parallax.folder, folder)
    assert list(checking._unused_files(read_exercise(folder))) == []
    (folder / "old-draft.a7s").write_text("scenario akwanga seed 1\n")
    (folder / "mounting.a7s").write_text("PHOT1?\n")
    reference = folder / "reference.a7s"
    reference.write_text(reference.read_text() + "include mounting.a7s\n")
    assert list(checking._unused_files(read_exercise(folder))) == [
        "old-draft.a7s: expected only files that the exercise uses, got one that it does not name"
    ]


def test_text_of_the_template_in_text_and_scripts_is_reported(parallax, tmp_path):
    folder = tmp_path / "04-parallax"
    shutil.copytree(parallax.folder, folder)
    (folder / "text.md").write_text(f"# Parallax\n\n{template.TEXT}\n")
    opening = folder / "opening.a7s"
    opening.write_text(f"{opening.read_text()}# {template.REMARK} Then look.\n")
    faults = list(checking._template_text(read_exercise(folder)))
    assert faults == [
        f"{place}: expected a text of your own, got that of the template: {text}"
        for place, text in (("text.md", template.TEXT), ("opening.a7s", template.REMARK))
    ]


def test_unused_files_in_folders_of_the_exercise_are_reported(parallax, tmp_path):
    folder = tmp_path / "04-parallax"
    shutil.copytree(parallax.folder, folder)
    (folder / "parts").mkdir()
    (folder / "parts" / "mounting.a7s").write_text("include centring.a7s\n")
    (folder / "parts" / "centring.a7s").write_text("PHOT1?\n")
    (folder / "parts" / "notes.txt").write_text("to do\n")
    (folder / ".editor").write_text("")
    reference = folder / "reference.a7s"
    reference.write_text(reference.read_text() + "include parts/mounting.a7s\n")
    assert list(checking._unused_files(read_exercise(folder))) == [
        "parts/notes.txt: expected only files that the exercise uses, got one that it does not name"
    ]


def test_the_check_rejects_template_text_and_unused_files(parallax, tmp_path):
    """Both are reported with the other faults of form, before any run: the reference is missing."""
    folder = tmp_path / "04-parallax"
    shutil.copytree(parallax.folder, folder)
    (folder / "reference.a7s").unlink()
    (folder / "old-draft.a7s").write_text("scenario akwanga seed 1\n")
    unfinished = wrong(ExerciseFolder(parallax.exercise, folder), goal=template.GOAL)
    assert faults_of(unfinished) == (
        "reference.a7s: expected a script beside the exercise, found none",
        f"goal: expected a text of your own, got that of the template: {template.GOAL}",
        "old-draft.a7s: expected only files that the exercise uses, got one that it does not name",
    )
