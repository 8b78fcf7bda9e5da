"""Reductions of files: tables and cards in, documents and files out (files.md).

The numerical part is in `a7sim.reduction`.
"""

from a7sim.processing.blocks import block
from a7sim.processing.centres import CENTRE_METHODS, CentreMethod, centres
from a7sim.processing.interior import CORRECTIONS, interior
from a7sim.processing.outcome import ProcessingResult, write_result
from a7sim.processing.pairs import RELATIVE_METHODS, RelativeMethod, relative
from a7sim.processing.similarities import SIMILARITY_METHODS, SimilarityMethod, similarity
from a7sim.processing.strips import absolute, connect, strip

__all__ = [
    "CENTRE_METHODS",
    "CORRECTIONS",
    "RELATIVE_METHODS",
    "SIMILARITY_METHODS",
    "CentreMethod",
    "ProcessingResult",
    "RelativeMethod",
    "SimilarityMethod",
    "absolute",
    "block",
    "centres",
    "connect",
    "interior",
    "relative",
    "similarity",
    "strip",
    "write_result",
]
