"""Why the instrument does not do what it is asked."""


class Refusal(Exception):
    """Something the instrument does not do; nothing has moved."""


class OutOfRange(Refusal):
    """Beyond an element's, a carriage's or a space rod's range."""


class SettingsConflict(Refusal):
    """Not allowed by the fittings, the base, the pictures mounted or the variant."""


class UnknownName(Refusal):
    """A name that this instrument has no use for."""
