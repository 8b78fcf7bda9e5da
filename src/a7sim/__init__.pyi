from a7sim import computing as computing
from a7sim import reduction as reduction
from a7sim.instrument import Autograph as Autograph
from a7sim.link.client import Client as Client
from a7sim.link.client import InstrumentRefused as InstrumentRefused
from a7sim.mistakes import Mistake as Mistake
from a7sim.scenario import Scenario as Scenario
from a7sim.scripting import Operator as Operator
from a7sim.scripting import Study as Study
from a7sim.scripting import connect as connect

__version__: str
__all__ = [
    "Autograph",
    "Client",
    "InstrumentRefused",
    "Mistake",
    "Operator",
    "Scenario",
    "Study",
    "computing",
    "connect",
    "reduction",
]
