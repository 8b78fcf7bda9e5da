"""Recording of random draws, to repeat the same draws without the rest of the work."""

import time
from contextlib import contextmanager

import numpy as np

_default_rng, _SeedSequence = np.random.default_rng, np.random.SeedSequence


class _Recorded:
    """Generator whose calls are recorded."""

    def __init__(self, generator, number, calls):
        self._generator, self._number, self._calls = generator, number, calls

    def __getattr__(self, name):
        method = getattr(self._generator, name)

        def called(*arguments, **named):
            self._calls.append((self._number, name, arguments, named))
            return method(*arguments, **named)

        return called


@contextmanager
def recording():
    """Yield the list of all generators made in the body, and all their calls, in order."""
    calls = []
    made = 0

    class Sequence(_SeedSequence):
        """Seed sequence whose creation is recorded."""

        def __init__(self, *arguments, **named):
            super().__init__(*arguments, **named)
            calls.append((None, "SeedSequence", arguments, named))

    def generator(seed=None):
        nonlocal made
        made += 1
        again = (seed.entropy, seed.spawn_key) if isinstance(seed, _SeedSequence) else (seed, None)
        calls.append((None, "default_rng", again, {}))
        return _Recorded(_default_rng(seed), made - 1, calls)

    np.random.default_rng, np.random.SeedSequence = generator, Sequence
    try:
        yield calls
    finally:
        np.random.default_rng, np.random.SeedSequence = _default_rng, _SeedSequence


def cpu_seconds_to_draw(calls):
    """Return the CPU seconds of making the recorded generators and drawing from them again."""
    seeds = [_SeedSequence(*c[2], **c[3]) for c in calls if c[1] == "SeedSequence"]
    known = {(each.entropy, each.spawn_key): each for each in seeds}
    generators = []
    began = time.process_time()
    for number, name, arguments, named in calls:
        if number is not None:
            getattr(generators[number], name)(*arguments, **named)
        elif name == "SeedSequence":
            _SeedSequence(*arguments, **named)
        else:
            seed, key = arguments
            generators.append(_default_rng(seed if key is None else known[seed, key]))
    return time.process_time() - began
