"""`a7sim train check-exercise` and `new`: for authors of exercises."""

from pathlib import Path

import click

from a7sim.cli import options
from a7sim.cli.completers import exercise_argument
from a7sim.result_documents import as_json, document_header
from a7sim.text import pluralize
from a7sim.training.catalogue import all_exercises, find_exercise
from a7sim.training.checking import check_exercise
from a7sim.training.template import write_template

EXIT_FAULTY = 1


@click.command("check-exercise")
@click.argument("exercises", nargs=-1, metavar="[EXERCISE]...", shell_complete=exercise_argument)
@options.as_document
def check_(exercises: tuple[str, ...], as_document: bool) -> None:
    """Check exercises: the reference passes, each faulty run fails for its reason, each criterion counts.

    All that come with a7sim, or the named ones. Exit code 1 if one is not consistent.

    Example: a7sim train check-exercise 4 my-exercises/20-clouds
    """
    checks = [check_exercise(each) for each in (map(find_exercise, exercises) if exercises else all_exercises())]
    if as_document:
        documents = [{"exercise": each.name, "faults": list(each.faults)} for each in checks]
        click.echo(as_json(document_header("train check") | {"exercises": documents}), nl=False)
    else:
        for each in checks:
            points = (
                "" if each.reference_points is None else f" (reference {pluralize(each.reference_points, 'point')})"
            )
            click.echo(f"{each.name}: {'holds' if not each.faults else f'{len(each.faults)} to mend'}{points}")
            for fault in each.faults:
                click.echo(f"  {fault}")
    if any(each.faults for each in checks):
        raise click.exceptions.Exit(EXIT_FAULTY)


@click.command("new")
@click.argument("folder", type=options.PLACE, metavar="NAME")
def new_(folder: Path) -> None:
    """Write the template of an exercise into a new folder; check-exercise lists what is missing.

    Example: a7sim train new 20-clouds
    """
    digits = folder.name.partition("-")[0]
    taken = [each.exercise.number for each in all_exercises()]
    number = int(digits) if digits.isdecimal() and 1 <= int(digits) <= 999 else max(taken, default=0) + 1
    click.echo(str(write_template(folder, number)))
