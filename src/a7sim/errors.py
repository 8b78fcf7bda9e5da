"""The one kind of error that a user can put right."""


class A7SimError(ValueError):
    """Bad input: its text is the sentence for the user (what was expected, what came, where)."""
