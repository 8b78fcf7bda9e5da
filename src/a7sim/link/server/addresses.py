"""Where a server listens: HOST:PORT as people write it."""

import ipaddress
import re
from dataclasses import dataclass

from a7sim.errors import A7SimError

_ADDRESS = re.compile(r"(?:\[([0-9A-Fa-f:.]+)\]|([^\s:\[\]]+)):(\d{1,5})")


@dataclass(frozen=True, slots=True)
class Address:
    """A host and a port; port 0 is one that the operating system chooses."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    @property
    def loopback(self) -> bool:
        """Whether only this machine can reach it."""
        if self.host == "localhost":
            return True
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return False


def parse_address(text: str, option: str) -> Address:
    """Return the address that a text such as 127.0.0.1:5025 or [::1]:5025 names. Raises Mistake."""
    found = _ADDRESS.fullmatch(text)
    if found is None or int(found[3]) > 65535:
        raise A7SimError(f"{option}: expected HOST:PORT such as 127.0.0.1:5025, got {text!r}")
    return Address(found[1] or found[2], int(found[3]))
