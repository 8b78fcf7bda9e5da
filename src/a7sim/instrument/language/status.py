"""Status model of IEEE 488.2 and SCPI-1999, one per client."""

from collections import deque
from dataclasses import astuple, dataclass, field
from typing import Any

from a7sim.instrument.language.errors import ErrorNumber, format_entry

QUEUE_LENGTH = 32

POWER_ON, COMMAND_ERROR, EXECUTION_ERROR, DEVICE_ERROR, QUERY_ERROR, OPERATION_COMPLETE = 128, 32, 16, 8, 4, 1
_ERROR_AVAILABLE, _QUESTIONABLE, _EVENT_SUMMARY, _MASTER_SUMMARY, _OPERATION = 4, 8, 32, 64, 128

SETTLING = 2
"""Bit 1 of the operation register: a part of the instrument is moving."""


@dataclass
class Register:
    """SCPI status register: condition, events, and the enabled events."""

    condition: int = 0
    event: int = 0
    enable: int = 0

    def set_condition(self, condition: int) -> None:
        """Change the condition; rising bits become events."""
        self.event |= condition & ~self.condition
        self.condition = condition

    def read_event(self) -> int:
        """Return the events and clear them."""
        event, self.event = self.event, 0
        return event


@dataclass
class Status:
    """Event status, service request, the two SCPI registers and the error queue of one client."""

    event: int = POWER_ON
    event_enable: int = 0
    service_enable: int = 0
    operation: Register = field(default_factory=Register)
    questionable: Register = field(default_factory=Register)
    errors: deque[str] = field(default_factory=deque)

    def state(self) -> dict[str, Any]:
        """Return all registers and the queue, for `restore`."""
        registers = {name: list(astuple(getattr(self, name))) for name in ("operation", "questionable")}
        enabled = {"event": self.event, "event_enable": self.event_enable, "service_enable": self.service_enable}
        return enabled | registers | {"errors": list(self.errors)}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a state."""
        self.event, self.event_enable = state["event"], state["event_enable"]
        self.service_enable = state["service_enable"]
        self.operation, self.questionable = Register(*state["operation"]), Register(*state["questionable"])
        self.errors = deque(state["errors"])

    def report(self, number: ErrorNumber, detail: str = "") -> None:
        """Queue an error and set its bit; in a full queue the last entry becomes an overflow."""
        if len(self.errors) < QUEUE_LENGTH:
            self.errors.append(format_entry(number, detail))
        else:
            self.errors[-1] = format_entry(ErrorNumber.QUEUE_OVERFLOW)
            self.event |= DEVICE_ERROR
        if -200 < number <= -100:
            self.event |= COMMAND_ERROR
        elif -300 < number <= -200:
            self.event |= EXECUTION_ERROR
        elif -400 < number <= -300:
            self.event |= DEVICE_ERROR
        elif -500 < number <= -400:
            self.event |= QUERY_ERROR

    def next_error(self) -> str:
        """Return and remove the oldest error."""
        return self.errors.popleft() if self.errors else format_entry(ErrorNumber.NO_ERROR)

    def read_event(self) -> int:
        """Return the standard event status and clear it."""
        event, self.event = self.event, 0
        return event

    def status_byte(self) -> int:
        """Return the status byte with the master summary in bit 6."""
        byte = _ERROR_AVAILABLE if self.errors else 0
        byte |= _QUESTIONABLE if self.questionable.event & self.questionable.enable else 0
        byte |= _EVENT_SUMMARY if self.event & self.event_enable else 0
        byte |= _OPERATION if self.operation.event & self.operation.enable else 0
        return byte | (_MASTER_SUMMARY if byte & self.service_enable else 0)

    def clear(self) -> None:
        """Clear events and errors; enables and conditions stay (`*CLS`)."""
        self.event = self.operation.event = self.questionable.event = 0
        self.errors.clear()
