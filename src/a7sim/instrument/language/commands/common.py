"""Functions shared by the commands of several subsystems."""

from typing import TYPE_CHECKING

from a7sim.instrument.language.context import CommandContext
from a7sim.instrument.language.errors import CommandError, ErrorNumber
from a7sim.instrument.language.table import Choice

if TYPE_CHECKING:
    from a7sim.instrument.autograph import Autograph


MAX_TEXT_LENGTH = 1000
"""Characters of a remark or of a point's name."""

ELEMENT_NODES = (
    ("KAPPa", "kappa", "gon", "swing"),
    ("PHI", "phi", "gon", "longitudinal tilt"),
    ("OMEGa", "omega", "gon", "lateral tilt"),
    ("BY", "by", "mm", "base component across"),
    ("BZ", "bz", "mm", "base component in height"),
    ("PDIStance", "c", "mm", "principal distance"),
)

LIMIT = Choice(("MINimum", "MAXimum", "DEFault"), optional=True)


def autograph_for(engine: CommandContext) -> "Autograph":
    """Return the instrument of an engine."""
    return engine.instrument.autograph


def format_fixed(value: float, decimals: int = 2) -> str:
    """Return a number with its decimals, never as minus zero."""
    return f"{value:z.{decimals}f}"


def text_argument(text: str) -> str:
    """Return a text argument. Raises CommandError for an empty or too long text."""
    if not 1 <= len(text) <= MAX_TEXT_LENGTH:
        raise CommandError(
            ErrorNumber.DATA_OUT_OF_RANGE, f"expected 1 to {MAX_TEXT_LENGTH} characters, got {len(text)}"
        )
    return text
