"""Time the study of the thesis against drawing its random numbers alone, and how the time grows.

A replicate is two models in five cases, three readings each of by' and by", twenty centres, and the twenty-five strips
that the models make, with residuals at checks. Prints CPU seconds of one process and peak memory; the ratio is to be at
most five. Growth with replicates, points measured, and models is given by the straight line through the times (fixed
cost, cost of one more) with the departures from it, and by the slope of their logarithms: 1 is linear, less
if a part of the time does not grow. Runs studies/thesis-1985.toml if it exists.
Usage: python benchmarks/study.py [--replicates N] [--chunk N] [--growth N]
"""

import argparse
import resource
import time
from itertools import product

import msgspec
import numpy as np
from drawing import cpu_seconds_to_draw, recording
from figures import Figure, Target, tell

from a7sim.reduction import Model, absolute_orientation, formed_strip
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene
from a7sim.session.session_batch import open_batch
from a7sim.standard_points import CASES
from a7sim.strip_methods.strip import ground_control, models_from_documents
from a7sim.study.loading import StudyError, load_study
from a7sim.study.running import ChunkPolicy
from a7sim.study.simulating import replicate_seed

TARGET = Target("at most", 5, "ratio")
ASKED_OF = 10_000
"""Replicates for the target."""

RECORDED = 50
"""Replicates whose draws are recorded and repeated for the number of replicates."""

SETTINGS = {"plan.parallax_readings": 3, "plan.measure_with": "both", "plan.centre_levels": [4900, 5100]}


def cpu_seconds(work):
    """Return the CPU seconds of work in this process."""
    began = time.process_time()
    work()
    return time.process_time() - began


def sessions(scenario, seeds):
    """Return documents of sessions without their own strips."""
    return open_batch(scenario, seeds).measure(strips=False)


class Thesis:
    """Work of the thesis without a study's file: sessions in all cases, strips of all combinations."""

    def __init__(self):
        self.scenarios = {case: load_scenario("akwanga", settings={**SETTINGS, "plan.case": case}) for case in CASES}

    def replicates(self, seeds):
        """Return rms at checks ``(strips, 3, complete sessions)``."""
        by_case = {case: sessions(scenario, seeds) for case, scenario in self.scenarios.items()}
        complete = [i for i in range(len(seeds)) if all(each[i]["status"] == "complete" for each in by_case.values())]
        models = {case: [models_from_documents(each[i]["models"]) for i in complete] for case, each in by_case.items()}
        scenario = self.scenarios["A"]
        ground = ground_control(scenario, build_scene(scenario, seeds[0]))
        return np.array([self._strips(models, cases, ground) for cases in product(CASES, repeat=2)])

    def _strips(self, models, cases, ground):
        stacked = [
            Model(one.name, one.points, np.stack([each[place].coordinates for each in models[case]], axis=-1))
            for place, case in enumerate(cases)
            for one in (models[case][0][place],)
        ]
        strip = formed_strip(stacked, self.scenarios[cases[0]].strip.join)
        oriented = absolute_orientation(strip, ground)
        return np.sqrt(np.nanmean(oriented.fit.at_checks**2, axis=1))


def study_work():
    """Return the work of replicates: of the study's file if it exists, otherwise composed here."""
    try:
        tasks = load_study("thesis-1985", replicates=1).tasks
    except StudyError:
        return Thesis().replicates, "the same work as studies/thesis-1985.toml, which is not there"
    return lambda seeds: [task.run_batch(seeds) for task in tasks], "studies/thesis-1985.toml"


def cpu_seconds_to_draw_often(calls, times):
    """Return the CPU seconds of `times` repetitions of the recorded draws."""
    return sum(cpu_seconds_to_draw(calls) for _ in range(times))


def the_whole(replicates, chunk):
    """Print the time of all replicates and of drawing their random numbers; return both, and memory, as figures.

    Half is drawn before each chunk and half after it, so that a change of the machine's speed affects both.
    """
    work, what = study_work()
    seeds = [replicate_seed(1985, replicate) for replicate in range(replicates)]
    work(seeds[:2])
    with recording() as calls:
        work(seeds[:RECORDED])
    recorded = min(RECORDED, replicates)
    took = drawing = 0.0
    for first in range(0, replicates, chunk):
        some = seeds[first : first + chunk]
        times = -(-len(some) // recorded)
        before = cpu_seconds_to_draw_often(calls, times // 2)
        took += cpu_seconds(lambda some=some: work(some))
        after = cpu_seconds_to_draw_often(calls, times - times // 2)
        drawing += (before + after) * len(some) / (recorded * times)
    ratio = took / drawing
    print(f"{what}: {replicates} replicates, {chunk} at once")
    print(f"study    {took:9.1f} s CPU  {1e3 * took / replicates:8.2f} ms a replicate")
    print(
        f"drawing  {drawing:9.1f} s CPU  {1e3 * drawing / replicates:8.2f} ms a replicate, {len(calls)} calls recorded"
    )
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"ratio    {ratio:9.1f}")
    print(f"memory   {memory:9.0f} MB at most")
    name, target = f"a replicate of {replicates}, CPU", TARGET if replicates >= ASKED_OF else None
    return [
        Figure(name, 1e3 * took / replicates, "ms", "drawing its random numbers alone", ratio, target),
        Figure(f"memory, {min(chunk, replicates)} replicates at once", memory, "MB"),
    ]


def flight_of(models, points):
    """Return a strip with numbers of models and of signalised points in each."""
    scenario = load_scenario("akwanga")
    first = scenario.photos[0]
    photos = [
        msgspec.structs.replace(
            scenario.photos[i % 3],
            name=str(101 + i),
            position=(first.position[0] - 728.0 * i, first.position[1], first.position[2]),
        )
        for i in range(models + 1)
    ]
    row = [
        msgspec.structs.replace(scenario.models[i % 2], name=str(i + 1), left=photos[i].name, right=photos[i + 1].name)
        for i in range(models)
    ]
    one = scenario.ground[0]
    ground = [
        msgspec.structs.replace(
            one,
            point=f"P{i}N{k}",
            X=first.position[0] - 728.0 * (i + 0.2 + 0.6 * k / max(points - 1, 1)),
            Y=first.position[1] + 300.0 * (-1) ** k,
            Z=None,
        )
        for i in range(models)
        for k in range(points)
    ]
    return msgspec.structs.replace(scenario, photos=photos, models=row, ground=ground)


def growth(replicates):
    """Print the growth of time with replicates, points and models; return lines, departures and slopes as figures."""
    plain = load_scenario("akwanga")
    grown = {
        "replicates": [(n, plain, n) for n in (5 * replicates // 2, 5 * replicates, 10 * replicates)],
        "points a model": [(n, flight_of(2, n), replicates) for n in (10, 40, 70, 100)],
        "models": [(n, flight_of(n, 10), replicates) for n in (1, 4, 8, 16)],
    }
    sessions(plain, range(2))
    figures = []
    for name, steps in grown.items():
        counts = np.array([count for count, _, _ in steps])
        seconds = np.array([cpu_seconds(lambda s=s, n=n: sessions(s, range(n))) for _, s, n in steps])
        each, fixed = np.polyfit(counts, seconds, 1, w=1.0 / seconds)
        departure = 100.0 * np.abs((fixed + each * counts) / seconds - 1.0).max()
        slope = np.polyfit(np.log(counts), np.log(seconds), 1)[0]
        listed = ", ".join(f"{count}: {took:.1f} s" for count, took in zip(counts, seconds, strict=True))
        print(f"{name:15} {listed}")
        print(
            f"{'':15} {fixed:.1f} s and {1e3 * each:.1f} ms each, off by {departure:.1f} % at most; slope {slope:.2f}"
        )
        figures += [
            Figure(f"one more of {name}", 1e3 * each, "ms"),
            Figure(f"time without {name}", fixed, "s"),
            Figure(f"departure from linear in {name}", departure, "%"),
            Figure(f"slope of log time over log {name}", slope),
        ]
    return figures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--replicates", type=int, default=200)
    parser.add_argument("--chunk", type=int, default=ChunkPolicy.largest_chunk, help="replicates at once")
    parser.add_argument("--growth", type=int, default=200, help="replicates of how time grows; 0 for none")
    asked = parser.parse_args()
    figures = the_whole(asked.replicates, asked.chunk)
    return figures + growth(asked.growth) if asked.growth else figures


if __name__ == "__main__":
    tell(main)
