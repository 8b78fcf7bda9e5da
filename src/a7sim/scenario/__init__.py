"""Scenarios: files that describe a flight, photographs, an instrument and an operator."""

from a7sim.scenario.loading import (
    ScenarioError,
    build_scenario,
    find_scenario,
    load_scenario,
    scenario_name,
    scenario_schema,
)
from a7sim.scenario.provenance import Provenance, ScenarioWithProvenance, amend_provenance, with_provenance
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
from a7sim.scenario.schema import ModelPlan as ModelPlan
from a7sim.scenario.serialization import from_data, hash_scenario, to_data
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
    "Provenance",
    "Scenario",
    "ScenarioError",
    "ScenarioWithProvenance",
    "StripPlan",
    "amend_provenance",
    "build_scenario",
    "find_scenario",
    "from_data",
    "hash_scenario",
    "load_scenario",
    "observer_of_skill",
    "scenario_name",
    "scenario_schema",
    "to_data",
    "with_provenance",
]
