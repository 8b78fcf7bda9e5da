"""Fixtures that several test files share."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("steady", derandomize=True, deadline=None)
settings.load_profile("steady")

BESIDE_THE_PROJECT = Path(__file__).parents[2] / "shared" / "reference"


@pytest.fixture(scope="session")
def reference() -> Path:
    """The folder of measurements and results that nobody of this project made up."""
    named = os.environ.get("A7SIM_REFERENCE")
    folder = Path(named) if named else BESIDE_THE_PROJECT
    if not named and not folder.is_dir():
        pytest.skip("no reference data: A7SIM_REFERENCE is not set and ../shared/reference is not there")
    assert folder.is_dir(), f"A7SIM_REFERENCE names {folder}, which is no folder"
    return folder
