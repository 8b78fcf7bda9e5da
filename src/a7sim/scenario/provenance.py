"""Provenance of a scenario: the command and the overrides that chose it."""

from collections.abc import Mapping
from types import MappingProxyType

from msgspec import Struct
from msgspec.structs import replace

from a7sim.scenario.schema import Scenario

NOTHING: Mapping[str, str] = MappingProxyType({})


class Provenance(Struct, frozen=True):
    """Provenance of a session: the command that repeats it, and the overrides of the scenario file."""

    command_line: str
    settings: dict[str, str]
    """Overridden values by their path."""


class ScenarioWithProvenance(Scenario, frozen=True, kw_only=True):
    """Scenario with its provenance."""

    request: Provenance


def with_provenance(scenario: Scenario, request: Provenance) -> ScenarioWithProvenance:
    """Return a scenario with its provenance."""
    values = {name: getattr(scenario, name) for name in Scenario.__struct_fields__}
    return ScenarioWithProvenance(**values, request=request)


def amend_provenance(scenario: Scenario, words: str, instead: str, settings: Mapping[str, str] = NOTHING) -> Scenario:
    """Return a scenario whose command line, if any, has other words and whose overrides are extended."""
    if not isinstance(scenario, ScenarioWithProvenance):
        return scenario
    request = scenario.request
    changed = Provenance(request.command_line.replace(words, instead), {**request.settings, **settings})
    return replace(scenario, request=changed)
