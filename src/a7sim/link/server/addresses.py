"""Addresses of a server in the form HOST:PORT."""

import ipaddress
import re
from dataclasses import dataclass

from a7sim.errors import A7SimError

_ADDRESS = re.compile(r"(?:\[([0-9A-Fa-f:.]+)\]|([^\s:\[\]]+)):(\d{1,5})")


@dataclass(frozen=True, slots=True)
class Address:
    """Host and port; the operating system chooses a port for 0."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    @property
    def loopback(self) -> bool:
        """Whether only this machine can connect."""
        if self.host == "localhost":
            return True
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return False


def parse_address(text: str, option: str) -> Address:
    """Return the address of a text such as 127.0.0.1:5025 or [::1]:5025. Raises A7SimError."""
    found = _ADDRESS.fullmatch(text)
    if found is None or int(found[3]) > 65535:
        raise A7SimError(f"{option}: expected HOST:PORT such as 127.0.0.1:5025, got {text!r}")
    return Address(found[1] or found[2], int(found[3]))
