"""How many examples Hypothesis tries: with `A7SIM_EXAMPLES=50` fifty times as many, and other ones every time."""

import os

from hypothesis import settings

TIMES = int(os.environ.get("A7SIM_EXAMPLES", "1"))

PROFILE = "steady"
settings.register_profile(PROFILE, derandomize=TIMES == 1, deadline=None, max_examples=100 * TIMES)


def examples(count: int) -> settings:
    """Return settings of a test that usually tries so many."""
    return settings(max_examples=count * TIMES, deadline=None)
