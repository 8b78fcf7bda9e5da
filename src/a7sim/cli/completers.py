"""Shell completion of arguments and options: names of files that come with a7sim, other files, and choices."""

from collections.abc import Callable, Iterable

import click
from click.shell_completion import CompletionItem

from a7sim.bundled import bundled_dirs, bundled_names

Completer = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


def _or_files(names: Callable[[], Iterable[str]]) -> Completer:
    """Return a completer of names; the shell completes files if no name matches."""

    def completer(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem]:
        found = [CompletionItem(name) for name in names() if name.startswith(incomplete)]
        return found or [CompletionItem(incomplete, type="file")]

    return completer


def _scripts() -> list[str]:
    return sorted({file.stem for shelf in bundled_dirs("scenarios") for file in shelf.glob("scripts/*.a7s")})


class CaseInsensitiveChoice(click.Choice[str]):
    """Choice that accepts lower and upper case, and is shown and completed in its own."""

    def __init__(self, choices: Iterable[str]) -> None:
        super().__init__(list(choices), case_sensitive=False)

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        """Return the choices as in help."""
        return f"[{'|'.join(self.choices)}]"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Return the matching choices."""
        return [CompletionItem(each) for each in self.choices if each.lower().startswith(incomplete.lower())]


scenario_argument = _or_files(lambda: bundled_names("scenarios"))
exercise_argument = _or_files(lambda: bundled_names("exercises"))
study_argument = _or_files(lambda: bundled_names("studies"))
session_argument = _or_files(_scripts)
"""Sessions are folders; scripts have names."""
