"""`a7sim train list` and `report`: progress of students."""

from pathlib import Path

import click
from rich.console import Console

from a7sim.cli import options
from a7sim.cli.completers import exercise_argument
from a7sim.cli.renamed import command_with_renamed_options
from a7sim.cli.train.options import progress_in, student_name, student_options
from a7sim.errors import A7SimError
from a7sim.journal.session_files import write_atomic
from a7sim.result_documents import Document, as_json, document_header
from a7sim.text import pluralize
from a7sim.text_tables import text_table
from a7sim.training.catalogue import all_exercises, find_exercise
from a7sim.training.exercise import ExerciseFolder
from a7sim.training.exports import HOME_PAGE, to_class_document, to_nbgrader, to_xapi


@click.command("list")
@click.argument("exercise", required=False, shell_complete=exercise_argument)
@options.as_document
@student_options
def list_(exercise: str | None, as_document: bool, home: Path | None, student: str | None) -> None:
    """List the exercises and the progress in them; or show the text of EXERCISE.

    Example: a7sim train list 4
    """
    if exercise is not None:
        exercise_folder = find_exercise(exercise)
        click.echo(
            as_json(_exercise_document(exercise_folder)) if as_document else f"{_exercise_text(exercise_folder)}\n",
            nl=False,
        )
        return
    name = student_name(student)
    with progress_in(home) as progress:
        best = progress.best(name)
        attempts = progress.attempts(name)
    rows = []
    for exercise_folder in all_exercises():
        tried = [each for each in attempts if each.exercise == exercise_folder.name]
        grade = best.get((name, exercise_folder.name))
        state = "passed" if grade and grade.grade.passed else "under way" if tried and not tried[-1].closed else ""
        points = grade.grade.points if grade else None
        rows.append((exercise_folder.exercise.number, exercise_folder.exercise.title, state, points, len(tried)))
    if as_document:
        keys = ("number", "title", "state", "points", "attempts")
        exercises = [dict(zip(keys, row, strict=True)) for row in rows]
        click.echo(as_json(document_header("train list") | {"student": name, "exercises": exercises}), nl=False)
        return
    table = text_table("", "exercise", "state", "points", "attempts", left=(1, 2), fold=(1,))
    for number, title, state, points, count in rows:
        table.add_row(str(number), title, state, "" if points is None else f"{points:g}", str(count or ""))
    Console().print(table)


def _exercise_document(exercise_folder: ExerciseFolder) -> Document:
    exercise = exercise_folder.exercise
    return document_header("train list") | {
        "exercise": exercise_folder.name,
        "number": exercise.number,
        "title": exercise.title,
        "text": exercise_folder.text.strip(),
        "minutes": exercise.minutes,
        "pass_points": exercise.pass_points,
        "hints": len(exercise.hints),
        "steps": [each.text for each in exercise.steps],
        "criteria": [{"title": each.title, "points": each.weight} for each in exercise.criteria],
    }


def _exercise_text(exercise_folder: ExerciseFolder) -> str:
    exercise = exercise_folder.exercise
    steps = [f"  - {each.text}" for each in exercise.steps]
    criteria = [f"  {each.weight:4g}  {each.title}" for each in exercise.criteria]
    minutes, hints = pluralize(exercise.minutes, "minute"), pluralize(len(exercise.hints), "hint")
    facts = f"{minutes}, {exercise.pass_points:g} of 100 points pass, {hints}"
    return "\n".join([exercise_folder.text.strip(), "", "To do:", *steps, "", "Graded (points):", *criteria, "", facts])


@click.command("report", cls=command_with_renamed_options({"--to": "--format"}))
@click.option("--class", "whole_class", is_flag=True, help="All students instead of one.")
@click.option(
    "--format",
    "file_format",
    type=click.Choice(["html", "csv", "json", "xapi"]),
    default="html",
    show_default=True,
    help="HTML page, nbgrader table, JSON document, or xAPI statements for a learning record store.",
)
@options.out_file("the page", "standard output")
@click.option(
    "--home-page",
    metavar="URL",
    default=HOME_PAGE,
    show_default=True,
    help="xapi: home page of the students' accounts.",
)
@student_options
def report_(
    whole_class: bool, file_format: str, out: Path | None, home_page: str, home: Path | None, student: str | None
) -> None:
    """Write the page of a student or of the class: HTML with figures, CSV as nbgrader's, JSON, or xAPI statements.

    Example: a7sim train report --class --format html --out class.html
    """
    name = None if whole_class else student_name(student)
    with progress_in(home) as progress:
        graded, best, attempts = progress.grades(name), progress.best(name), progress.attempts(name)
    if not attempts:
        raise A7SimError(f"{f'student {name}' if name else 'the class'}: expected attempts to report on, found none")
    if file_format == "csv":
        text = to_nbgrader(best)
    elif file_format == "json":
        text = as_json(to_class_document(graded, best, attempts))
    elif file_format == "xapi":
        text = to_xapi(graded, home_page)
    else:
        from a7sim.training.html_sheets import class_sheet, student_sheet  # only pages need figures

        catalogue = all_exercises()
        text = class_sheet(catalogue, best, attempts) if name is None else student_sheet(name, catalogue, best, graded)
    if out is None:
        click.echo(text, nl=False)
    else:
        write_atomic(out, text)
        click.echo(str(out))
