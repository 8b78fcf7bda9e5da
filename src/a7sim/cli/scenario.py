"""`a7sim scenario`: validation and schema of scenario files."""

import click

from a7sim.cli import EXIT_USAGE, options
from a7sim.cli.completers import scenario_argument
from a7sim.errors import A7SimError
from a7sim.result_documents import as_json, document_header
from a7sim.scenario import ScenarioError, load_scenario, scenario_schema
from a7sim.scene import build_scene
from a7sim.text import pluralize


@click.group("scenario")
def command() -> None:
    """Check scenario files and describe them.

    Example: a7sim scenario validate akwanga
    """


@command.command("validate")
@click.argument("file", metavar="SCENARIO", shell_complete=scenario_argument)
@options.as_document
def validate(file: str, as_document: bool) -> None:
    """List all errors of a SCENARIO and of the files it names; exit code 2 if there are any.

    Example: a7sim scenario validate scenarios/akwanga.toml
    """
    try:
        scenario = load_scenario(file)
        build_scene(scenario, scenario.seed)
        mistakes = []
    except ScenarioError as error:
        mistakes = error.mistakes
    except A7SimError as mistake:
        mistakes = str(mistake).splitlines()
    if as_document:
        click.echo(as_json(document_header("scenario validate") | {"file": file, "mistakes": mistakes}), nl=False)
    elif mistakes:
        for mistake_text in mistakes:
            click.echo(f"a7sim: {file}: {mistake_text}", err=True)
    else:
        photographs, models = pluralize(len(scenario.photos), "photograph"), pluralize(len(scenario.models), "model")
        click.echo(f"{file}: {scenario.title}, {photographs}, {models}")
    if mistakes:
        raise click.exceptions.Exit(EXIT_USAGE)


@command.command("schema")
@options.as_document
def schema(as_document: bool) -> None:
    """Print the JSON Schema of scenario files; with --json, within a document as other commands print.

    Example: a7sim scenario schema > scenario.schema.json
    """
    described = scenario_schema()
    click.echo(
        as_json(document_header("scenario schema") | {"schema": described} if as_document else described), nl=False
    )
