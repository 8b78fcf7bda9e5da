"""A scenario as somebody asked for it, which no file says."""

from collections.abc import Mapping
from types import MappingProxyType

from msgspec import Struct
from msgspec.structs import replace

from a7sim.scenario.schema import Scenario

NOTHING: Mapping[str, str] = MappingProxyType({})


class Provenance(Struct, frozen=True):
    """How somebody asked for a session: the command that gives it again, and what it changed in the scenario's file."""

    command_line: str
    settings: dict[str, str]
    """Changed values by their path."""


class ScenarioWithProvenance(Scenario, frozen=True, kw_only=True):
    """A scenario with the request that chose it."""

    request: Provenance


def with_provenance(scenario: Scenario, request: Provenance) -> ScenarioWithProvenance:
    """Return a scenario with the request that chose it."""
    values = {name: getattr(scenario, name) for name in Scenario.__struct_fields__}
    return ScenarioWithProvenance(**values, request=request)


def amend_provenance(scenario: Scenario, words: str, instead: str, settings: Mapping[str, str] = NOTHING) -> Scenario:
    """Return a scenario whose request, where it has one, says something instead of words and changes more settings."""
    if not isinstance(scenario, ScenarioWithProvenance):
        return scenario
    request = scenario.request
    changed = Provenance(request.command_line.replace(words, instead), {**request.settings, **settings})
    return replace(scenario, request=changed)
