"""Scenarios as plain data: no scenario file is needed, only the measurements that it names."""

import hashlib
from pathlib import Path
from typing import Any

import msgspec

from a7sim.errors import A7SimError
from a7sim.scenario.loading import SEARCH_PATH
from a7sim.scenario.provenance import ScenarioWithProvenance
from a7sim.scenario.schema import Scenario


def to_data(scenario: Scenario) -> dict[str, Any]:
    """Return a complete scenario as data for JSON; measurements that come with a7sim are named by their file name.

    The provenance, if any, is included.
    """
    return _naming(msgspec.to_builtins(scenario), _shelved)


def from_data(data: Any) -> Scenario:
    """Return the scenario of serialized data. Raises A7SimError for invalid data."""
    try:
        return msgspec.convert(_naming(data, _found), ScenarioWithProvenance if "request" in data else Scenario)
    except (msgspec.ValidationError, TypeError, AttributeError) as error:
        raise A7SimError(f"expected a scenario of this version of a7sim, got another: {error}") from error


def hash_scenario(scenario: Scenario) -> str:
    """Return the SHA-256 of a scenario and of the measurements that it names, independent of its provenance.

    Raises A7SimError if a file is missing.
    """
    content = {name: value for name, value in to_data(scenario).items() if name != "request"}
    digest = hashlib.sha256(msgspec.json.encode(content, order="sorted"))
    for file in sorted({photo.measured.file for photo in scenario.photos if photo.measured}):
        try:
            digest.update(Path(file).read_bytes())
        except OSError as error:
            raise A7SimError(f"{file}: expected the measurements of the scenario: {error.strerror}") from error
    return digest.hexdigest()


def _naming(data: dict[str, Any], name: Any) -> dict[str, Any]:
    photos = [
        {**photo, "measured": {**photo["measured"], "file": name(photo["measured"]["file"])}}
        if photo.get("measured")
        else photo
        for photo in data["photos"]
    ]
    return {**data, "photos": photos}


def _shelved(file: str) -> str:
    path = Path(file).resolve()
    return path.name if path.parent in [shelf.resolve() for shelf in SEARCH_PATH] else str(path)


def _found(file: str) -> str:
    shelved = (shelf / file for shelf in SEARCH_PATH if Path(file).name == file)
    return str(next((path for path in shelved if path.is_file()), file))
