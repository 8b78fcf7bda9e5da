"""Base class of errors that a user can correct."""


class A7SimError(ValueError):
    """Bad input: its text is one sentence for the user (expected, got, where)."""
