"""Scenarios: what a file may say about a flight, photographs, an instrument and an operator."""

from a7sim.scenario.carried import carried, hash_of, scenario_from
from a7sim.scenario.loading import (
    ScenarioError,
    bare_name,
    find_scenario,
    load_scenario,
    scenario_of,
    scenario_schema,
)
from a7sim.scenario.requests import Request, RequestedScenario, rephrased, requested
from a7sim.scenario.schema import (
    SCHEMA_VERSION,
    Camera,
    Comparator,
    Condition,
    GridPlate,
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
from a7sim.scenario.skills import PROFILES, observer_of_skill

__all__ = [
    "PROFILES",
    "SCHEMA_VERSION",
    "Camera",
    "Comparator",
    "Condition",
    "GridPlate",
    "GridTest",
    "Instrument",
    "ModelPlan",
    "Observer",
    "Photo",
    "Plan",
    "ProjectorCondition",
    "Request",
    "RequestedScenario",
    "Scenario",
    "ScenarioError",
    "StripPlan",
    "bare_name",
    "carried",
    "find_scenario",
    "hash_of",
    "load_scenario",
    "observer_of_skill",
    "rephrased",
    "requested",
    "scenario_from",
    "scenario_of",
    "scenario_schema",
]
