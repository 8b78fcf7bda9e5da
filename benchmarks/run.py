"""Time an Akwanga session against its floor: the same lines through the same client to a port that only answers.

Prints the ratio of both with the accuracy of the session.
"""

import statistics
import time

from figures import Figure, Target, tell

from a7sim.link.client.client import Client
from a7sim.operator import measure_models
from a7sim.scenario import load_scenario
from a7sim.session import open_session, run

SEEDS = range(1, 6)


class Parrot:
    """Port that answers each line at once with the recorded answer of the instrument."""

    def __init__(self, answers):
        self._answers = iter(answers)

    def write(self, data):
        return len(data)

    def readline(self, size=-1):
        return next(self._answers)


def floor_of(scenario, seed):
    """Return the seconds of the session's traffic without an instrument."""
    exchanged = []
    session = open_session(scenario, seed, lambda event: exchanged.append((event.direction, event.text)))
    list(measure_models(session.person, session.job))
    answers = [text.encode() + b"\n" for direction, text in exchanged if direction == "<"]
    client = Client(Parrot(answers))
    began = time.perf_counter()
    for i, (direction, text) in enumerate(exchanged):
        if direction == ">":
            if i + 1 < len(exchanged) and exchanged[i + 1][0] == "<":
                client.ask(text)
            else:
                client.send(text)
    return time.perf_counter() - began, len(exchanged)


def main():
    scenario = load_scenario("akwanga")
    print("seed  session s  floor s  ratio  lines  lines/s  rms parallax mm (models 1, 2)")
    ratios, seconds, worst = [], [], 0.0
    for seed in SEEDS:
        floor, lines = floor_of(scenario, seed)
        began = time.perf_counter()
        document = run(scenario, seed)
        took = time.perf_counter() - began
        ratios.append(took / floor)
        seconds.append(took)
        parallaxes = [m["relative_orientation"]["rms_parallax_mm"] for m in document["models"]]
        worst = max(worst, *parallaxes)
        rms = ", ".join(f"{each:.4f}" for each in parallaxes)
        print(f"{seed:4}  {took:9.3f}  {floor:7.4f}  {took / floor:5.0f}  {lines:5}  {lines / took:7.0f}  {rms}")
    ratio = statistics.median(ratios)
    print(f"median ratio to the floor {ratio:.0f}")
    return [
        Figure("an Akwanga session", statistics.median(seconds), "s", "its lines, answered by a parrot", ratio),
        Figure(f"largest rms parallax of {len(SEEDS)} sessions", worst, "mm", target=Target("below", 0.05)),
    ]


if __name__ == "__main__":
    tell(main)
