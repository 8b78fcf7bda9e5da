"""Draw docs/figures/empirical.svg: how clearing point by point converges, by the parallax equation and measured."""

from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("svg")
import matplotlib.pyplot as plt

from a7sim.operator.driving.scpi_driver import ScpiDriver
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.people.operator_batch import OperatorBatch
from a7sim.operator.procedures.empirical import over_correction
from a7sim.operator.procedures.models import measure_models_batch, orient_model
from a7sim.scenario import load_scenario
from a7sim.session import open_session

COLOURS = {"1": "#a3431f", "1.5": "#b8860b", '"computed"': "#1f5f8b", "3": "#5b4a8a"}
LABELS = {"1": "n = 1", "1.5": "n = 1.5", '"computed"': "n computed", "3": "n = 3"}
SHARES = ("0.7", "1", "1.3", "1.6", "1.9", "2.2", "2.5", "2.8", "3.2")
SEEDS = (1, 2, 4)
WELL_ABOVE_NOISE_MM = 0.5
INK, SOFT = "#222222", "#8a8a8a"


class _IsReady(Exception):
    """Relative orientation would begin."""


def _stop(activity):
    if "relative orientation" in activity:
        raise _IsReady


def seen_at_six(n_and_seed):
    """What is seen at point 6 in the rounds of a session, mm, and (1 + z^2/d^2)/2 there."""
    n, seed = n_and_seed
    plan = {"plan.procedure": '"empirical"', "plan.start_off_gon": "2", "plan.over_correction": n}
    session = open_session(load_scenario("akwanga", plan | {"plan.tolerated_parallax_um": "1000"}), seed)
    workstation = Workstation(OperatorBatch.single(session.person), ScpiDriver(session.person), session.job)
    with suppress(_IsReady):
        next(measure_models_batch(workstation, _stop))
    found = orient_model(workstation, session.job.models[0]).for_session(0)
    _, y, z = found.places["6"]
    return [abs(each.parallaxes["6"]) for each in found.rounds], float(over_correction(z, abs(y)))


def measured():
    cases = [(n, seed) for n in dict.fromkeys((*COLOURS, *SHARES)) for seed in SEEDS]
    with ProcessPoolExecutor(2) as pool:
        return dict(zip(cases, pool.map(seen_at_six, cases), strict=True))


def rounds(axes, sessions):
    axes.set_title("y-parallax at point 6, in parts of the first", loc="left")
    n0 = np.mean([each for _, each in sessions.values()])
    for n, colour in COLOURS.items():
        share = 0.0 if n.startswith('"') else abs(1.0 - float(n) / n0)
        number = np.arange(1, 12)
        axes.plot(number, np.maximum(share ** (number - 1.0), 1e-4), color=colour, lw=1.2)
        for seed in SEEDS:
            p, _ = sessions[n, seed]
            label = LABELS[n] if seed == SEEDS[0] else None
            axes.plot(np.arange(1, len(p) + 1), np.array(p) / p[0], "o", color=colour, ms=4, alpha=0.8, label=label)
    axes.set_yscale("log")
    axes.set_ylim(1e-3, 1.5)
    axes.set_xlim(0.7, 11.3)
    axes.set_xlabel("round")
    axes.legend(frameon=False, loc="upper right")


def factors(axes, sessions):
    axes.set_title("What a round leaves of it", loc="left")
    n0 = float(np.mean([each for _, each in sessions.values()]))
    n = np.linspace(0.5, 3.4, 100)
    axes.plot(n, np.abs(1.0 - n / n0), color=INK, lw=1.2, label="|1 - n/n0|, the parallax equation")
    first = "measured, from round to round"
    for (turned, _), (seen, _) in sessions.items():
        if turned.startswith('"'):
            continue
        p = np.array(seen)
        ratios = (p[1:] / p[:-1])[p[:-1] > WELL_ABOVE_NOISE_MM]
        axes.plot(np.full(len(ratios), float(turned)), ratios, "o", color=COLOURS["1"], ms=4, alpha=0.6, label=first)
        first = None
    axes.axvline(n0, color=SOFT, lw=0.8, ls=":")
    axes.text(n0 + 0.04, 0.72, f"n0 = (1 + z²/d²)/2 = {n0:.2f}", color=SOFT)
    axes.set_xlabel("n, times the turn that just clears point 6")
    axes.set_ylim(0.0, 0.9)
    axes.legend(frameon=False, loc="upper center")


def main():
    plt.rcParams.update({"font.size": 10, "svg.hashsalt": "a7sim", "svg.fonttype": "none", "font.family": "sans-serif"})
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.4), layout="constrained")
    sessions = measured()
    rounds(left, sessions)
    factors(right, sessions)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(Path(__file__).with_suffix(".svg"), metadata={"Date": None}, facecolor="white")
    return figure


if __name__ == "__main__":
    main()
