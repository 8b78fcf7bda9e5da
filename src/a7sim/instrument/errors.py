"""Why the instrument does not do what it is asked."""


class AutographError(Exception):
    """Something the instrument does not do; nothing has moved."""


class OutOfRangeError(AutographError):
    """Beyond an element's, a carriage's or a space rod's range."""


class SettingsConflictError(AutographError):
    """Not allowed by the fittings, the base, the pictures mounted or the variant."""


class UnknownNameError(AutographError):
    """A name that this instrument has no use for."""
