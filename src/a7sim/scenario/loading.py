"""Loading of a scenario from its TOML file."""

import tomllib
from collections.abc import Mapping, Sequence
from copy import deepcopy
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec

from a7sim.bundled import bundled_dirs, bundled_names
from a7sim.errors import A7SimError
from a7sim.scenario.cross_checks import cross_check_errors
from a7sim.scenario.schema import Scenario, register_loader
from a7sim.scenario.skills import PROFILES
from a7sim.scenario.validation import schema_errors
from a7sim.table_files import describe_missing_file, read_toml

SEARCH_PATH = bundled_dirs("scenarios")
"""Folders of the scenarios that come with a7sim."""


class ScenarioError(A7SimError):
    """Invalid scenario; `mistakes` lists each error with its path."""

    def __init__(self, source: str, mistakes: Sequence[str]) -> None:
        self.source = source
        self.mistakes = list(mistakes)
        super().__init__("\n".join(f"{source}: {mistake}" for mistake in self.mistakes))


def find_scenario(name: str | Path) -> Path:
    """Return the path of a scenario file, given as a path or as the name of a scenario that comes with a7sim.

    Raises ScenarioError if there is none.
    """
    path = Path(name)
    try:
        if path.is_file():
            return path
    except OSError as error:
        raise ScenarioError(str(name)[:200], [f"expected a readable file: {error.strerror}"]) from error
    for shelf in SEARCH_PATH:
        found = shelf / f"{path.name.removesuffix('.toml')}.toml"
        if path.parent in (Path(), Path("scenarios")) and found.is_file():
            return found
    known = ", ".join(bundled_names("scenarios"))
    raise ScenarioError(str(name), [f"expected a scenario file or one of {known}, found {describe_missing_file(path)}"])


def scenario_name(name: str | Path) -> str:
    """Return the name of a scenario wherever its file is:

    its bare name if it comes with a7sim, otherwise its file name.
    """
    path = find_scenario(name).resolve()
    return path.stem if path.parent in [shelf.resolve() for shelf in SEARCH_PATH] else path.name


def load_scenario(
    name: str | Path, overrides: Mapping[str, str] | None = None, settings: Mapping[str, Any] | None = None
) -> Scenario:
    """Return the scenario of a file with overrides such as ``{"plan.case": '"B"'}`` (values in TOML).

    `settings` are the same as values: ``{"plan.case": "B"}``. Raises ScenarioError with all errors.
    """
    path = find_scenario(name)
    try:
        raw = _with_skill_as_table(read_toml(path))
    except A7SimError as error:
        raise ScenarioError(str(path), [str(error).removeprefix(str(path)).lstrip(":, ")]) from error
    for key, text in (overrides or {}).items():
        _set(raw, key, _value_of(text), f"--set {key}={text}")
    for key, value in (settings or {}).items():
        _set(raw, key, deepcopy(value), key)
    return build_scenario(raw, path.parent, str(path))


def build_scenario(raw: Mapping[str, Any], folder: Path, source: str = "scenario") -> Scenario:
    """Return the scenario of raw tables; its files are in `folder`. Raises ScenarioError."""
    if "photos" not in raw and "responses" in raw:
        raise ScenarioError(source, ["expected a scenario, got a study (`a7sim study` takes it)"])
    raw = _with_models(_with_profile(_with_skill_as_table(raw)))
    mistakes = [
        *schema_errors(raw, _expected()),
        *cross_check_errors(raw, folder),
    ]
    if mistakes:
        raise ScenarioError(source, mistakes)
    scenario = msgspec.convert(raw, Scenario)
    photos = [
        msgspec.structs.replace(
            photo,
            measured=msgspec.structs.replace(photo.measured, file=str(folder / photo.measured.file)),
        )
        if photo.measured
        else photo
        for photo in scenario.photos
    ]
    return msgspec.structs.replace(scenario, photos=photos)


def _with_models(raw: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the tables with a model of each photograph and the next if they define no models."""
    photos = raw.get("photos")
    if "models" in raw or not isinstance(photos, list):
        return raw
    names = [photo.get("name") for photo in photos if isinstance(photo, Mapping)]
    pairs = enumerate(pairwise(names), start=1)
    return {**raw, "models": [{"name": str(i), "left": left, "right": right} for i, (left, right) in pairs]}


def _with_skill_as_table(raw: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables with ``observer = "novice"`` as a table."""
    observer = raw.get("observer")
    return {**raw, "observer": {"skill": observer}} if isinstance(observer, str) and observer in PROFILES else dict(raw)


def _with_profile(raw: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the tables with the profile of the observer completed by the values of the file."""
    observer = raw.get("observer")
    profile = PROFILES.get(str(observer.get("skill"))) if isinstance(observer, Mapping) else None
    return {**raw, "observer": {**profile, **observer}} if profile and isinstance(observer, Mapping) else raw


def scenario_schema() -> dict[str, Any]:
    """Return the JSON Schema of scenario files."""
    schema = msgspec.json.schema(Scenario)
    observer = schema["$defs"]["Scenario"]["properties"]["observer"]
    table = {"$ref": observer.pop("$ref")} if "$ref" in observer else {"allOf": observer.pop("allOf")}
    observer["anyOf"] = [{"enum": list(PROFILES)}, table]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


@cache
def _expected() -> msgspec.inspect.Type:
    return msgspec.inspect.type_info(Scenario)


def _value_of(text: str) -> Any:
    """Return a value parsed as TOML, or the text itself."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        return text


def _set(raw: dict[str, Any], key: str, value: Any, source: str) -> None:
    *parents, last = key.split(".")
    table: Any = raw
    for parent in parents:
        try:
            table = table[_index(parent)] if isinstance(table, list) else table.setdefault(parent, {})
        except (ValueError, IndexError):
            table = None
        if not isinstance(table, dict | list):
            raise ScenarioError(source, [f"expected the path of a scenario value such as plan.case, got {key!r}"])
    try:
        if isinstance(table, list):
            table[_index(last)] = value
        else:
            table[last] = value
    except (ValueError, IndexError):
        raise ScenarioError(source, [f"expected the path of a scenario value, got {key!r}"]) from None


def _index(text: str) -> int:
    if not text.isdecimal():
        raise ValueError
    return int(text)


register_loader(lambda path, settings: load_scenario(path, settings=settings))
