"""Pages of a student and of a class, each one self-contained HTML file."""

from collections.abc import Mapping, Sequence
from statistics import median
from typing import TYPE_CHECKING

from a7sim.report.drawing import INK, LEFT, RIGHT, drawing
from a7sim.report.page import Chapter, PageFigure, Paragraph, Part, TableBlock, page
from a7sim.text import pluralize
from a7sim.training.exercise import FULL_MARKS, ExerciseFolder
from a7sim.training.grading import EXCELLENT, Grade
from a7sim.training.progress import Attempt, GradeRecord

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Best = Mapping[tuple[str, str], GradeRecord]


def student_sheet(student: str, catalogue: Sequence[ExerciseFolder], best: Best, graded: Sequence[GradeRecord]) -> str:
    """Return the page of a student: results, and advice for each exercise."""
    mine = {exercise: each for (name, exercise), each in best.items() if name == student}
    passed = sum(each.grade.passed for each in mine.values())
    lead: list[Part] = [Paragraph(f"{passed} of {pluralize(len(catalogue), 'exercise')} passed, {len(mine)} tried.")]
    chapters = [Chapter("Where you stand", [_points(catalogue, mine), _overview(catalogue, mine, graded)])]
    for exercise_folder in catalogue:
        each = mine.get(exercise_folder.name)
        if each is not None:
            chapters.append(
                Chapter(f"{exercise_folder.exercise.number} {exercise_folder.exercise.title}", list(_of_exercise(each)))
            )
    return page(f"{student}: exercises at the plotter", lead, chapters)


def _overview(
    catalogue: Sequence[ExerciseFolder], mine: Mapping[str, GradeRecord], graded: Sequence[GradeRecord]
) -> TableBlock:
    rows = []
    for exercise_folder in catalogue:
        each = mine.get(exercise_folder.name)
        tried = sum(other.attempt.exercise == exercise_folder.name for other in graded)
        name = f"{exercise_folder.exercise.number} {exercise_folder.exercise.title}"
        if each is None:
            rows.append([name, "open", "", "", ""])
        else:
            grade = each.grade
            rows.append([name, _verdict(grade), f"{grade.points:g}", str(grade.hints), str(tried)])
    return TableBlock(
        "Best grade of each exercise", ["exercise", "", "points", "hints", "graded"], rows, frozenset({0, 1})
    )


def _verdict(grade: Grade) -> str:
    return "passed" if grade.passed else "not passed"


def _of_exercise(each: GradeRecord) -> Sequence[Part]:
    grade, attempt = each.grade, each.attempt
    after = f", {pluralize(grade.hints, 'hint')} (-{grade.hint_points:g})" if grade.hints else ""
    first = Paragraph(
        f"{_verdict(grade).capitalize()} with {grade.points:g} of {FULL_MARKS:g} points{after}; "
        f"attempt {attempt.number}, {attempt.mode}, {pluralize(grade.minutes, 'minute')} at the instrument's clock."
    )
    rows = [[mark.title, mark.band, f"{mark.points:g} of {mark.weight:g}", mark.reason] for mark in grade.marks]
    table = TableBlock("What was graded", ["criterion", "", "points", "why"], rows, frozenset({0, 1, 3}))
    advice = [mark for mark in grade.marks if mark.band != EXCELLENT]
    better = [Paragraph(f"{mark.title} (-{mark.lost:g}): {mark.feedback}") for mark in advice]
    return [first, table, *better]


def _points(catalogue: Sequence[ExerciseFolder], mine: Mapping[str, GradeRecord]) -> PageFigure:
    numbers = [str(each.exercise.number) for each in catalogue]
    points = [mine[each.name].grade.points if each.name in mine else 0.0 for each in catalogue]
    colours = [LEFT if each.name in mine and mine[each.name].grade.passed else RIGHT for each in catalogue]
    said = "; ".join(f"exercise {n}: {p:g}" for n, p in zip(numbers, points, strict=True))
    with drawing("points", "Points of each exercise", said, size=(8.0, 3.2), wide=True) as drawn:
        axes = drawn.axes[0]
        axes.bar(numbers, points, color=colours, edgecolor=INK, width=0.65)
        _what_passes(axes, catalogue)
        axes.set(xlabel="exercise", ylabel="points", ylim=(0.0, FULL_MARKS))
        axes.grid(axis="y")
        axes.set_axisbelow(True)
        drawn.legend = "Blue passed, red not passed; dotted, the points that pass unless a required criterion failed"
    return drawn.picture


def _what_passes(axes: "Axes", catalogue: Sequence[ExerciseFolder]) -> None:
    """Draw the points required to pass each exercise."""
    for place, exercise_folder in enumerate(catalogue):
        limit = exercise_folder.exercise.pass_points
        axes.plot([place - 0.45, place + 0.45], [limit] * 2, ":", color=INK, linewidth=1.6)


def class_sheet(catalogue: Sequence[ExerciseFolder], best: Best, attempts: Sequence[Attempt]) -> str:
    """Return the page of a class: results, and frequent mistakes."""
    students = sorted({each.student for each in attempts})
    lead: list[Part] = [Paragraph(f"{pluralize(len(students), 'student')}, {pluralize(len(attempts), 'attempt')}.")]
    rows = [
        [
            student,
            str(_passed(best, [student], catalogue)),
            *(_cell(best.get((student, each.name))) for each in catalogue),
        ]
        for student in students
    ]
    totals = [_passed(best, students, [each]) for each in catalogue]
    rows.append(["how many passed", str(sum(totals)), *map(str, totals)])
    columns = ["student", "passed", *(str(each.exercise.number) for each in catalogue)]
    table = TableBlock("Best points by exercise; in brackets: not passed", columns, rows)
    chapters = [
        Chapter("The class", [_spread(catalogue, best), table]),
        Chapter("What went wrong", [_mistakes(catalogue, best)]),
    ]
    return page("Exercises at the plotter: the class", lead, chapters)


def _passed(best: Best, students: Sequence[str], catalogue: Sequence[ExerciseFolder]) -> int:
    """Return the total number of these exercises passed by these students."""
    grades = [best.get((student, exercise_folder.name)) for student in students for exercise_folder in catalogue]
    return sum(each is not None and each.grade.passed for each in grades)


def _cell(each: GradeRecord | None) -> str:
    if each is None:
        return ""
    return f"{each.grade.points:g}" if each.grade.passed else f"({each.grade.points:g})"


def _spread(catalogue: Sequence[ExerciseFolder], best: Best) -> PageFigure:
    by_exercise = [[each.grade.points for (_, name), each in best.items() if name == s.name] for s in catalogue]
    numbers = [str(each.exercise.number) for each in catalogue]
    said = "; ".join(
        f"exercise {n}: median {median(some):g} of {pluralize(len(some), 'student')}" if some else f"exercise {n}: none"
        for n, some in zip(numbers, by_exercise, strict=True)
    )
    with drawing("spread", "Points of the class by exercise", said, size=(8.0, 3.6), wide=True) as drawn:
        axes = drawn.axes[0]
        for place, some in enumerate(by_exercise):
            axes.plot([place] * len(some), some, "o", color=LEFT, alpha=0.5, markersize=6)
            if some:
                axes.plot([place - 0.3, place + 0.3], [median(some)] * 2, color=RIGHT)
        _what_passes(axes, catalogue)
        axes.set_xticks(range(len(numbers)), numbers)
        axes.set(xlabel="exercise", ylabel="points", ylim=(0.0, 1.04 * FULL_MARKS))
        axes.grid(axis="y")
        drawn.legend = "Each dot a student, line the median; dotted, the points that pass"
    return drawn.picture


def _mistakes(catalogue: Sequence[ExerciseFolder], best: Best) -> TableBlock:
    rows = []
    for exercise_folder in catalogue:
        marked = [each.grade.marks for (_, name), each in best.items() if name == exercise_folder.name]
        for criterion in exercise_folder.exercise.criteria:
            bands = [mark.band for marks in marked for mark in marks if mark.id == criterion.id]
            failed = sum(band == "fail" for band in bands)
            if failed:
                rows.append([f"{exercise_folder.exercise.number}: {criterion.title}", f"{failed} of {len(bands)}"])
    rows.sort(key=lambda row: -int(row[1].split()[0]))
    return TableBlock("Criteria that were failed, those of most students first", ["criterion", "failed"], rows)
