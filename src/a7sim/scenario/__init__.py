"""Scenarios: what a file may say about a flight, photographs, an instrument and an operator."""

from a7sim.scenario.loading import (
    ScenarioError,
    find_scenario,
    load_scenario,
    scenario_of,
    scenario_schema,
)
from a7sim.scenario.schema import (
    SCHEMA_VERSION,
    Camera,
    Comparator,
    Condition,
    GridTest,
    Instrument,
    Observer,
    Photo,
    Plan,
    ProjectorCondition,
    Scenario,
    StripPlan,
)
from a7sim.scenario.schema import Model as ModelPlan

__all__ = [
    "SCHEMA_VERSION",
    "Camera",
    "Comparator",
    "Condition",
    "GridTest",
    "Instrument",
    "ModelPlan",
    "Observer",
    "Photo",
    "Plan",
    "ProjectorCondition",
    "Scenario",
    "ScenarioError",
    "StripPlan",
    "find_scenario",
    "load_scenario",
    "scenario_of",
    "scenario_schema",
]
