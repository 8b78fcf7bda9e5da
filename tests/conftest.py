"""Fixtures that several test files share."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def reference() -> Path:
    """The folder of measurements and results that nobody of this project made up."""
    folder = os.environ.get("A7SIM_REFERENCE")
    if not folder:
        pytest.skip("A7SIM_REFERENCE does not name the folder of reference data")
    assert Path(folder).is_dir(), f"A7SIM_REFERENCE names {folder}, which is no folder"
    return Path(folder)
