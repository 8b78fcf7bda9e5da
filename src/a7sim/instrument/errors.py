"""Errors of the instrument."""


class AutographError(Exception):
    """Action that the instrument cannot execute; nothing has moved."""


class OutOfRangeError(AutographError):
    """Beyond the range of an element, a carriage or a space rod."""


class SettingsConflictError(AutographError):
    """Not allowed by the fittings, the base, the mounted pictures or the variant."""


class UnknownNameError(AutographError):
    """Name that this instrument does not know."""
