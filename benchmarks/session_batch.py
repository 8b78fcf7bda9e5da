"""Time a batch of Akwanga sessions against drawing its random numbers alone, and against one session over the link.

Prints CPU seconds, their ratio, and whether the counters read the same as over the link. Usage: python
benchmarks/session_batch.py [SESSIONS...]
"""

import sys
import time

from drawing import cpu_seconds_to_draw, recording
from figures import Figure, Target, tell

from a7sim.operator import measure_models
from a7sim.scenario import load_scenario
from a7sim.session import open_session
from a7sim.session.session_batch import open_batch

SESSIONS = (1, 50, 200, 800)
RECORDED = 20


def main():
    counts = [int(each) for each in sys.argv[1:]] or SESSIONS
    scenario = load_scenario("akwanga")
    session = open_session(scenario, 0)
    began = time.process_time()
    alone = list(measure_models(session.person, session.job))
    over_the_line = time.process_time() - began
    print(f"one session over the line: {over_the_line:.2f} s CPU")
    with recording() as calls:
        list(open_batch(scenario, range(RECORDED)).measure_models())
    print("sessions  open s  work s  ms a session  drawing s  ratio  same readings")
    figures = []
    for sessions in counts:
        began = time.process_time()
        batch = open_batch(scenario, range(sessions))
        opened = time.process_time()
        records = list(batch.measure_models())
        worked = time.process_time()
        drawing = cpu_seconds_to_draw(calls) * sessions / RECORDED
        same = all(one.points == many.for_session(0).points for one, many in zip(alone, records, strict=True))
        took = worked - began
        print(
            f"{sessions:8}  {opened - began:6.2f}  {took:6.2f}  {1e3 * took / sessions:12.1f}  {drawing:9.3f}  "
            f"{took / drawing:5.1f}  {same}"
        )
        each, drawn = 1e3 * took / sessions, took / drawing
        name = f"a session of {sessions} at once, CPU"
        figures += [
            Figure(name, each, "ms", "drawing its random numbers alone", drawn),
            Figure(name, each, "ms", "one over the line", took / sessions / over_the_line),
            Figure(f"{sessions} at once, first reads as over the line", float(same), target=Target("at least", 1)),
        ]
    return figures


if __name__ == "__main__":
    tell(main)
