"""Programs of benchmarks/ as modules."""

import sys
from importlib import import_module
from pathlib import Path

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


def benchmark(name):
    """Import a program of benchmarks/ as it is when run from there, behind whatever else is called so."""
    if str(BENCHMARKS) not in sys.path:
        sys.path.append(str(BENCHMARKS))
    return import_module(name)
