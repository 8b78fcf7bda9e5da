"""Recording device: registrations of the operator, numbered, never erased."""

from dataclasses import dataclass, field, replace

from a7sim.instrument.errors import OutOfRangeError, SettingsConflictError


@dataclass(frozen=True)
class Registration:
    """Counters and elements registered under a point; a struck registration stays, marked."""

    number: int
    point: str
    readings: tuple[tuple[str, str], ...]
    """Name and reading as the counter showed it."""
    struck: str | None = None


@dataclass
class Recorder:
    """Registrations in order, numbered from 1."""

    registrations: list[Registration] = field(default_factory=list)
    changes: list[Registration] = field(default_factory=list)
    """Changes of registrations, made or struck, in order: the changes since some time are a tail."""

    def register(self, point: str, readings: list[tuple[str, str]]) -> Registration:
        """Add a registration and return it."""
        registration = Registration(len(self.registrations) + 1, point, tuple(readings))
        self.apply(registration)
        return registration

    def apply(self, change: Registration) -> None:
        """Apply a recorded change of a registration."""
        self.registrations[change.number - 1 : change.number] = [change]
        self.changes.append(change)

    def strike(self, number: int, why: str) -> None:
        """Mark a registration as struck out, once.

        Raises OutOfRangeError for an unknown number, SettingsConflictError for one that is already struck.
        """
        registration = self.by_number(number)
        if registration.struck is not None:
            raise SettingsConflictError(f"registration {number} is struck out already")
        self.apply(replace(registration, struck=why))

    def by_number(self, number: int) -> Registration:
        """Return a registration. Raises OutOfRangeError for an unknown number."""
        if not 1 <= number <= len(self.registrations):
            raise OutOfRangeError(f"expected a registration 1 to {len(self.registrations)}, got {number}")
        return self.registrations[number - 1]
