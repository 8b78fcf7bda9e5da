"""Number of examples of Hypothesis: `A7SIM_EXAMPLES=50` multiplies it by 50 and draws new ones in each run."""

import os

from hypothesis import settings

TIMES = int(os.environ.get("A7SIM_EXAMPLES", "1"))

PROFILE = "steady"
settings.register_profile(PROFILE, derandomize=TIMES == 1, deadline=None, max_examples=100 * TIMES)


def examples(count: int) -> settings:
    """Return settings of a test with `count` examples, multiplied by `A7SIM_EXAMPLES`."""
    return settings(max_examples=count * TIMES, deadline=None)
