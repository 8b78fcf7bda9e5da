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


def student_sheet(student: str, catalogue: Sequence[ExerciseFolder], best: Best, grades: Sequence[GradeRecord]) -> str:
    """Return the page of a student: results, and advice for each exercise."""
    own_best = {exercise: each for (name, exercise), each in best.items() if name == student}
    passed = sum(each.grade.passed for each in own_best.values())
    lead: list[Part] = [
        Paragraph(f"{passed} of {pluralize(len(catalogue), 'exercise')} passed, {len(own_best)} tried.")
    ]
    chapters = [Chapter("Results", [_points_figure(catalogue, own_best), _overview(catalogue, own_best, grades)])]
    for exercise_folder in catalogue:
        each = own_best.get(exercise_folder.name)
        if each is not None:
            chapters.append(
                Chapter(
                    f"{exercise_folder.exercise.number} {exercise_folder.exercise.title}", list(_exercise_parts(each))
                )
            )
    return page(f"{student}: exercises at the plotter", lead, chapters)


def _overview(
    catalogue: Sequence[ExerciseFolder], own_best: Mapping[str, GradeRecord], grades: Sequence[GradeRecord]
) -> TableBlock:
    rows = []
    for exercise_folder in catalogue:
        each = own_best.get(exercise_folder.name)
        attempt_count = sum(other.attempt.exercise == exercise_folder.name for other in grades)
        name = f"{exercise_folder.exercise.number} {exercise_folder.exercise.title}"
        if each is None:
            rows.append([name, "open", "", "", ""])
        else:
            grade = each.grade
            rows.append([name, _verdict(grade), f"{grade.points:g}", str(grade.hints), str(attempt_count)])
    return TableBlock(
        "Best grade of each exercise", ["exercise", "", "points", "hints", "graded"], rows, frozenset({0, 1})
    )


def _verdict(grade: Grade) -> str:
    return "passed" if grade.passed else "not passed"


def _exercise_parts(each: GradeRecord) -> Sequence[Part]:
    grade, attempt = each.grade, each.attempt
    after = f", {pluralize(grade.hints, 'hint')} (-{grade.hint_points:g})" if grade.hints else ""
    first = Paragraph(
        f"{_verdict(grade).capitalize()} with {grade.points:g} of {FULL_MARKS:g} points{after}; "
        f"attempt {attempt.number}, {attempt.mode}, {pluralize(grade.minutes, 'minute')} on the instrument's clock."
    )
    rows = [[mark.title, mark.band, f"{mark.points:g} of {mark.weight:g}", mark.reason] for mark in grade.marks]
    table = TableBlock("Criteria", ["criterion", "", "points", "why"], rows, frozenset({0, 1, 3}))
    advice = [mark for mark in grade.marks if mark.band != EXCELLENT]
    better = [Paragraph(f"{mark.title} (-{mark.lost:g}): {mark.feedback}") for mark in advice]
    return [first, table, *better]


def _points_figure(catalogue: Sequence[ExerciseFolder], own_best: Mapping[str, GradeRecord]) -> PageFigure:
    numbers = [str(each.exercise.number) for each in catalogue]
    points = [own_best[each.name].grade.points if each.name in own_best else 0.0 for each in catalogue]
    colours = [LEFT if each.name in own_best and own_best[each.name].grade.passed else RIGHT for each in catalogue]
    description = "; ".join(f"exercise {n}: {p:g}" for n, p in zip(numbers, points, strict=True))
    with drawing("points", "Points of each exercise", description, size=(8.0, 3.2), wide=True) as drawn:
        axes = drawn.axes[0]
        axes.bar(numbers, points, color=colours, edgecolor=INK, width=0.65)
        _draw_pass_limits(axes, catalogue)
        axes.set(xlabel="exercise", ylabel="points", ylim=(0.0, FULL_MARKS))
        axes.grid(axis="y")
        axes.set_axisbelow(True)
        drawn.legend = "Blue: passed. Red: not passed. Dotted: points required to pass if no required criterion failed"
    return drawn.picture


def _draw_pass_limits(axes: "Axes", catalogue: Sequence[ExerciseFolder]) -> None:
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
            str(_count_passed(best, [student], catalogue)),
            *(_cell(best.get((student, each.name))) for each in catalogue),
        ]
        for student in students
    ]
    totals = [_count_passed(best, students, [each]) for each in catalogue]
    rows.append(["students who passed", str(sum(totals)), *map(str, totals)])
    columns = ["student", "passed", *(str(each.exercise.number) for each in catalogue)]
    table = TableBlock("Best points by exercise; in brackets: not passed", columns, rows)
    chapters = [
        Chapter("The class", [_spread_figure(catalogue, best), table]),
        Chapter("Frequent mistakes", [_failed_criteria(catalogue, best)]),
    ]
    return page("Exercises at the plotter: the class", lead, chapters)


def _count_passed(best: Best, students: Sequence[str], catalogue: Sequence[ExerciseFolder]) -> int:
    """Return the total number of these exercises passed by these students."""
    grades = [best.get((student, exercise_folder.name)) for student in students for exercise_folder in catalogue]
    return sum(each is not None and each.grade.passed for each in grades)


def _cell(each: GradeRecord | None) -> str:
    if each is None:
        return ""
    return f"{each.grade.points:g}" if each.grade.passed else f"({each.grade.points:g})"


def _spread_figure(catalogue: Sequence[ExerciseFolder], best: Best) -> PageFigure:
    by_exercise = [
        [each.grade.points for (_, name), each in best.items() if name == folder.name] for folder in catalogue
    ]
    numbers = [str(each.exercise.number) for each in catalogue]
    description = "; ".join(
        f"exercise {n}: median {median(points):g} of {pluralize(len(points), 'student')}"
        if points
        else f"exercise {n}: none"
        for n, points in zip(numbers, by_exercise, strict=True)
    )
    with drawing("spread", "Points of the class by exercise", description, size=(8.0, 3.6), wide=True) as drawn:
        axes = drawn.axes[0]
        for place, points in enumerate(by_exercise):
            axes.plot([place] * len(points), points, "o", color=LEFT, alpha=0.5, markersize=6)
            if points:
                axes.plot([place - 0.3, place + 0.3], [median(points)] * 2, color=RIGHT)
        _draw_pass_limits(axes, catalogue)
        axes.set_xticks(range(len(numbers)), numbers)
        axes.set(xlabel="exercise", ylabel="points", ylim=(0.0, 1.04 * FULL_MARKS))
        axes.grid(axis="y")
        drawn.legend = "Dot: a student. Line: the median. Dotted: points required to pass"
    return drawn.picture


def _failed_criteria(catalogue: Sequence[ExerciseFolder], best: Best) -> TableBlock:
    rows = []
    for exercise_folder in catalogue:
        marked = [each.grade.marks for (_, name), each in best.items() if name == exercise_folder.name]
        for criterion in exercise_folder.exercise.criteria:
            bands = [mark.band for marks in marked for mark in marks if mark.id == criterion.id]
            failed = sum(band == "fail" for band in bands)
            if failed:
                rows.append([f"{exercise_folder.exercise.number}: {criterion.title}", f"{failed} of {len(bands)}"])
    rows.sort(key=lambda row: -int(row[1].split()[0]))
    return TableBlock("Failed criteria, the most frequent first", ["criterion", "failed"], rows)
