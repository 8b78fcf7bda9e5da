"""Time a crowd of Akwanga sessions against drawing its random numbers alone, and against one session over the line.

Prints CPU seconds, their ratio, and beside them that the counters read the same as over the line.
Usage: python benchmarks/crowd.py [SESSIONS...]
"""

import sys
import time

from a7sim.operator import work
from a7sim.operator.dice import Dice
from a7sim.scenario import load_scenario
from a7sim.session import open_session
from a7sim.session.crowd import open_crowd

SESSIONS = (1, 50, 200, 800)


class Recorded(Dice):
    """Dice that remember what was asked of them."""

    def __init__(self, observer, seed):
        super().__init__(observer, seed)
        self.asked = []

    def errors(self, sigma, shape):
        self.asked.append(("errors", sigma, shape))
        return super().errors(sigma, shape)

    def slips(self, shape):
        self.asked.append(("slips", shape))
        return super().slips(shape)


def drawing_alone(scenario, asked, sessions):
    """CPU seconds to draw for so many sessions what one asked for."""
    began = time.process_time()
    for seed in range(sessions):
        dice = Dice(scenario.observer, seed)
        for kind, *arguments in asked:
            getattr(dice, kind)(*arguments)
    return time.process_time() - began


def main():
    counts = [int(each) for each in sys.argv[1:]] or SESSIONS
    scenario = load_scenario("akwanga")
    session = open_session(scenario, 0)
    session.person.dice = dice = Recorded(scenario.observer, 0)
    began = time.process_time()
    alone = list(work(session.person, session.job))
    print(f"one session over the line: {time.process_time() - began:.2f} s CPU")
    print("sessions  open s  work s  ms a session  drawing s  ratio  same readings")
    for sessions in counts:
        began = time.process_time()
        crowd = open_crowd(scenario, range(sessions))
        opened = time.process_time()
        records = list(crowd.worked())
        worked = time.process_time()
        drawing = drawing_alone(scenario, dice.asked, sessions)
        same = all(one.points == many.of(0).points for one, many in zip(alone, records, strict=True))
        took = worked - opened
        print(
            f"{sessions:8}  {opened - began:6.2f}  {took:6.2f}  {1e3 * took / sessions:12.1f}  {drawing:9.3f}  "
            f"{took / drawing:5.1f}  {same}"
        )


if __name__ == "__main__":
    main()
