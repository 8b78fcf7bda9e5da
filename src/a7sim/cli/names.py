"""What a shell completes an argument with: the names of what comes with a7sim, else files."""

from collections.abc import Callable, Iterable

import click
from click.shell_completion import CompletionItem

from a7sim.shelves import names_of, shelves_of

Completer = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


def _or_files(names: Callable[[], Iterable[str]]) -> Completer:
    """Return a completer of names; where none begins so, the shell completes files."""

    def completer(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
        found = [CompletionItem(name) for name in names() if name.startswith(incomplete)]
        return found or [CompletionItem(incomplete, type="file")]

    return completer


def _scripts() -> list[str]:
    return sorted({file.stem for shelf in shelves_of("scenarios") for file in shelf.glob("scripts/*.a7s")})


a_scenario = _or_files(lambda: names_of("scenarios"))
an_exercise = _or_files(lambda: names_of("exercises"))
a_study = _or_files(lambda: names_of("studies"))
a_session = _or_files(_scripts)
"""Sessions are folders; scripts have names."""
