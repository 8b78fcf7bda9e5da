"""Pass rates of the operator's three profiles at the exercises, many seeds each, with their requirements.

Prints a table of passes by profile with the criteria that failed most often, and writes skills.csv and skills.svg.
Usage: python benchmarks/skills.py [EXERCISE...] [--seeds 50] [--first-seed 1000] [--workers N] [--out DIR] [--draw]
"""

import argparse
import csv
import os
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

from figures import Figure, Target, tell
from msgspec.structs import replace

from a7sim.errors import A7SimError
from a7sim.training.attempts import run_attempt
from a7sim.training.catalogue import all_exercises, find_exercise
from a7sim.training.exercise import PlayedRun
from a7sim.training.grading import grade_folder

FIGURES = Path(__file__).parents[1] / "docs" / "figures"

ASKED = {"first-order": Target("at least", 98), "trained": Target("at least", 90), "novice": Target("below", 60)}
"""Required share of passed attempts at each of the exercises `OF` by profile, %."""

ASKED_OF = 50
"""Seeds for this requirement."""

OF = range(5, 12)

BY_HAND = {
    "03-interior": PlayedRun(procedure="interior orientation"),
    "04-parallax": PlayedRun(procedure="measure parallaxes"),
    "05-one-projector": PlayedRun(procedure="relative orientation"),
}
"""Procedures of exercises whose reference is a script."""

COLOURS = {"first-order": "#1f5f8b", "trained": "#6b8e23", "novice": "#a3431f"}
MARKS = {"first-order": "o", "trained": "s", "novice": "D"}
INK, SOFT, FAINT = "#222222", "#6f6f6f", "#dddddd"


@dataclass(frozen=True)
class Tried:
    """Results of a profile's attempts at an exercise."""

    exercise: str
    title: str
    profile: str
    seeds: int
    passed: int
    median_points: float
    median_minutes: float
    failed: str
    """Failed criteria with their counts, most frequent first."""

    @property
    def share(self):
        """Share of passed attempts, %."""
        return 100.0 * self.passed / self.seeds

    @property
    def figure(self):
        """Return the number of passed attempts compared with the requirement."""
        asked = int(self.exercise.partition("-")[0]) in OF and self.seeds >= ASKED_OF
        name = f"{self.exercise}, {self.profile}: passed of {self.seeds}"
        return Figure(name, self.share, "%", target=ASKED[self.profile] if asked else None)


def procedure_of(shelved):
    """Return the operator's procedure at an exercise, None without one."""
    reference = shelved.exercise.reference
    return reference if reference.procedure else BY_HAND.get(shelved.name)


def attempt(name, profile, seed):
    """Return passed, points, minutes and the failed criteria of an attempt."""
    exercise_folder = find_exercise(name)
    played = replace(procedure_of(exercise_folder), observer={"skill": profile})
    with tempfile.TemporaryDirectory() as place:
        try:
            run_attempt(exercise_folder, played, Path(place), seed)
            grade = grade_folder(exercise_folder, seed, Path(place))
        except A7SimError as error:
            raise SystemExit(f"{name}, {profile}, seed {seed}: {error}") from error
    return grade.passed, grade.points, grade.minutes, [each.id for each in grade.failed]


def tried(exercises, seeds, workers):
    """Return the results of all profiles' attempts, by exercise, then by profile."""
    wanted = [(shelved.name, profile, seed) for shelved in exercises for profile in ASKED for seed in seeds]
    with ProcessPoolExecutor(workers) as pool:
        came = dict(zip(wanted, pool.map(attempt, *zip(*wanted, strict=True), chunksize=2), strict=True))
    return [
        summed(shelved, profile, [came[shelved.name, profile, seed] for seed in seeds])
        for shelved in exercises
        for profile in ASKED
    ]


def summed(shelved, profile, attempts):
    passed, points, minutes, failed = zip(*attempts, strict=True)
    criteria = Counter(each for some in failed for each in some)
    return Tried(
        shelved.name,
        shelved.exercise.title,
        profile,
        len(attempts),
        sum(passed),
        round(median(points), 1),
        round(median(minutes), 1),
        " ".join(f"{name}:{count}" for name, count in criteria.most_common()),
    )


def print_rows(rows):
    print(f"{'exercise':<26}{'profile':<13}{'passed':>9}  {'asked':<14}{'points':>7}{'minutes':>9}  failed")
    for each in rows:
        target, met = each.figure.target, each.figure.met
        asked = "" if target is None else f"{'>=' if target.sense == 'at least' else '<'} {target.limit:.0f} %"
        verdict = {None: "", True: " ok", False: " NOT"}[met]
        print(
            f"{each.exercise:<26}{each.profile:<13}{f'{each.passed}/{each.seeds}':>9}  {asked + verdict:<14}"
            f"{each.median_points:>7g}{each.median_minutes:>9g}  {each.failed}"
        )


def kept(rows, path):
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(asdict(rows[0])), lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(each) for each in rows)


def read(path):
    with path.open(encoding="utf-8", newline="") as file:
        return [
            Tried(
                **{key: row[key] for key in ("exercise", "title", "profile", "failed")},
                **{key: int(row[key]) for key in ("seeds", "passed")},
                **{key: float(row[key]) for key in ("median_points", "median_minutes")},
            )
            for row in csv.DictReader(file)
        ]


def drawn(rows, path):
    import matplotlib

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    plt.rcParams.update({"font.size": 10, "svg.hashsalt": "a7sim", "svg.fonttype": "none", "font.family": "sans-serif"})
    names = list(dict.fromkeys(each.exercise for each in rows))
    figure, axes = plt.subplots(figsize=(9.5, 1.6 + 0.5 * len(names)), layout="constrained")
    titles = {each.exercise: each.title.partition(":")[0] for each in rows}
    for profile, target in ASKED.items():
        offset = 0.24 * (1 - list(ASKED).index(profile))
        mine = [each for each in rows if each.profile == profile]
        places = [len(names) - 1 - names.index(each.exercise) + offset for each in mine]
        axes.hlines(places, 0, [each.share for each in mine], color=COLOURS[profile], lw=1.4, alpha=0.55)
        label = f"{profile} ({'≥' if target.sense == 'at least' else '<'} {target.limit:.0f} % asked of 5 to 11)"
        axes.plot([each.share for each in mine], places, MARKS[profile], color=COLOURS[profile], ms=6, label=label)
        axes.axvline(target.limit, color=COLOURS[profile], lw=1.0, ls=":")
        for each, place in zip(mine, places, strict=True):
            number = f"{each.passed} of {each.seeds}"
            axes.text(105, place, number, color=COLOURS[profile], va="center", fontsize=8)
    for between in range(len(names) - 1):
        axes.axhline(between + 0.5, color=FAINT, lw=0.8)
    axes.set_yticks(range(len(names)), [f"{int(each[:2])} {titles[each]}" for each in reversed(names)])
    axes.set(xlim=(-2, 118), ylim=(-0.5, len(names) - 0.5), xlabel="attempts that passed, %")
    axes.set_xticks(range(0, 101, 20))
    axes.tick_params(axis="y", length=0)
    axes.spines[["top", "right", "left"]].set_visible(False)
    figure.suptitle("Who passes: three virtual operators, each with other photographs every time", x=0.01, ha="left")
    figure.legend(frameon=False, loc="outside lower left", ncols=3, fontsize=9, columnspacing=1.2)
    figure.savefig(path, metadata={"Date": None}, facecolor="white")


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("exercises", nargs="*", metavar="EXERCISE", help="all with a procedure where none is named")
    options.add_argument("--seeds", type=int, default=50)
    options.add_argument("--first-seed", type=int, default=1000)
    options.add_argument("--workers", type=int, default=os.cpu_count())
    options.add_argument("--out", type=Path, default=FIGURES, help="folder of skills.csv and skills.svg")
    options.add_argument("--draw", action="store_true", help="only draw again what skills.csv says")
    given = options.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    table, figure = given.out / "skills.csv", given.out / "skills.svg"
    if given.draw:
        drawn(read(table), figure)
        return []
    named = [find_exercise(each) for each in given.exercises] or all_exercises()
    without = [each.name for each in named if procedure_of(each) is None]
    if given.exercises and without:
        options.error(f"{', '.join(without)}: expected exercises that the virtual operator can do")
    began = time.perf_counter()
    seeds = range(given.first_seed, given.first_seed + given.seeds)
    rows = tried([each for each in named if procedure_of(each) is not None], seeds, given.workers)
    print_rows(rows)
    print(f"seeds {seeds.start} to {seeds.stop - 1}, {given.workers} processes: {time.perf_counter() - began:.0f} s")
    kept(rows, table)
    drawn(rows, figure)
    return [each.figure for each in rows]


if __name__ == "__main__":
    tell(main)
