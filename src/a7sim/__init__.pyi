from a7sim import processing as processing
from a7sim import reduction as reduction
from a7sim.api import Operator as Operator
from a7sim.api import Study as Study
from a7sim.api import connect as connect
from a7sim.errors import A7SimError as A7SimError
from a7sim.instrument import Autograph as Autograph
from a7sim.link.client.client import Client as Client
from a7sim.link.client.client import InstrumentError as InstrumentError
from a7sim.scenario import Scenario as Scenario

__version__: str
__all__ = [
    "A7SimError",
    "Autograph",
    "Client",
    "InstrumentError",
    "Operator",
    "Scenario",
    "Study",
    "connect",
    "processing",
    "reduction",
]
