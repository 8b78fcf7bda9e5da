"""One counter for lewis: the same query as the plotter's, and a reply of the same length."""

from typing import ClassVar

from lewis.adapters.stream import Cmd, StreamInterface
from lewis.devices import Device


class Counter(Device):
    """A register."""

    x = -123.45


class CounterInterface(StreamInterface):
    """The register on a line."""

    commands: ClassVar = {Cmd("show", r"^COUN:X\?$")}
    in_terminator = "\n"
    out_terminator = "\n"

    def show(self):
        """Return what it reads."""
        return f"{self.device.x:.2f}"
