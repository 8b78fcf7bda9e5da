"""A simulated Wild A7 Autograph, the language it is worked in, and the operator who works it.

Importing it teaches pyserial the URL ``a7sim://SCENARIO?seed=N``.
"""

import serial

__version__ = "0.1.0"

if "a7sim.link" not in serial.protocol_handler_packages:
    serial.protocol_handler_packages.append("a7sim.link")
