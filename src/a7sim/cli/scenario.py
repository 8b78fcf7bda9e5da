"""`a7sim scenario`: is a scenario file right, and what may it say?"""

import click
import msgspec

from a7sim.cli import EXIT_MISTAKE
from a7sim.mistakes import Mistake
from a7sim.scenario import ScenarioError, load_scenario, scenario_schema
from a7sim.scene import build_scene


@click.group("scenario")
def command() -> None:
    """Check scenario files and describe them."""


@command.command("validate")
@click.argument("file")
@click.option("--json", "as_document", is_flag=True, help="Print the mistakes as one JSON document.")
def validate(file: str, as_document: bool) -> None:
    """Name every mistake of a scenario FILE and of the files it names; exit code 2 if there is any.

    Example: a7sim scenario validate scenarios/akwanga.toml
    """
    try:
        scenario = load_scenario(file)
        build_scene(scenario, scenario.seed)
        mistakes = []
    except ScenarioError as error:
        mistakes = error.mistakes
    except Mistake as mistake:
        mistakes = str(mistake).splitlines()
    if as_document:
        document = {"schema_version": 1, "command": "scenario validate", "file": file, "mistakes": mistakes}
        click.echo(msgspec.json.encode(document))
    elif mistakes:
        for mistake_text in mistakes:
            click.echo(f"a7sim: {file}: {mistake_text}", err=True)
    else:
        click.echo(f"{file}: {scenario.title}, {len(scenario.photos)} photographs, {len(scenario.models)} models")
    if mistakes:
        raise click.exceptions.Exit(EXIT_MISTAKE)


@command.command("schema")
@click.option("--json", "as_document", is_flag=True, help="Print it inside one JSON document of a7sim.")
def schema(as_document: bool) -> None:
    """Print the JSON Schema of scenario files.

    Example: a7sim scenario schema > scenario.schema.json
    """
    described = scenario_schema()
    if as_document:
        described = {"schema_version": 1, "command": "scenario schema", "schema": described}
    click.echo(msgspec.json.format(msgspec.json.encode(described), indent=2))
