"""Print what a strip by comparator and on the A8 leaves at its checks, beside the table of paper P.

Medians over seeds, each a flight's film, an A8 and its people; then, with fewer seeds, what single errors make of it.
docs/a8-strip.md holds what it printed.
Usage: python benchmarks/a8_strip.py [SEEDS [SEEDS_OF_SINGLE_ERRORS]], where the latter may be 0
"""

import sys
import time

import numpy as np
from figures import Figure, Target, tell

from a7sim.scenario import load_scenario
from a7sim.strip_methods.a8_vs_comparator import compare_a8_to_comparator

P_TABLE = {"comparator": ((7, 11, 15), (15, 28, 31)), "a8": ((15, 19, 22), (33, 43, 44))}
"""cm: mean square and largest residuals in x, y, z at 36 checks."""

WITHIN_A_THIRD = Target("between", (2 / 3, 4 / 3), "ratio")

P_DIFFERENCES = ((17, 19, 25), (29, 34, 45))
P_CLOSING = (0.01, 0.02)

ALL_POINTINGS_HALVED = {
    "observer.monocular_um": "2.0",
    "observer.stereo_um": "2.0",
    "observer.height_um": "1.5",
    "observer.parallax_um": "2.0",
}
SHARP_IMAGES = {"film.irregular_um": "1.5", "film.identification_um": "0.0"}
CHANGES = {
    "as it stands": {},
    "pointings half as large": ALL_POINTINGS_HALVED,
    "repeated pointings independent": {"observer.repeat_share": "1.0"},
    "film irregular 1.5 um (Akwanga's)": {"film.irregular_um": "1.5"},
    "no identification error": {"film.identification_um": "0.0"},
    "film 1.5 um in all, pointings halved": ALL_POINTINGS_HALVED | SHARP_IMAGES,
    "comparator mono": {"comparator.kind": '"mono"'},
    "comparator on 15 points a model": {"comparator.case": '"E"'},
    "A8 without local errors": {"instrument.grid_test.local_um": "0.0"},
    "A8 local errors anew at every point": {"instrument.grid_test.local": '"scattered"'},
    "film shrinkage 50, shear 25 ppm": {"film.shrinkage_sigma_ppm": "50.0", "film.shear_sigma_ppm": "25.0"},
    "earth's curve (comparator corrects)": {"air.earth_curvature": "true"},
}


def median_cm(values):
    return np.median(100.0 * values, axis=1)


def row(name, values, numbers=3):
    return f"{name:<38}" + "".join(f"{value:>8.1f}" for value in values[:numbers])


def whole_table(comparison):
    """Print how ours stands beside P's; return the rms as figures."""
    figures = []
    print(f"cm, medians over {len(comparison.seeds)} seeds (5 to 95 %)          x               y               z")
    for way, (p_rms, p_largest) in P_TABLE.items():
        residuals = getattr(comparison, way)
        for what, found, printed in (("rms", residuals.rms, p_rms), ("largest", residuals.largest, p_largest)):
            low, high = np.percentile(100.0 * found, (5, 95), axis=1)
            spread = zip(median_cm(found), low, high, strict=True)
            print(f"{way + ' ' + what:<28}" + "".join(f"{m:>6.1f} ({a:.0f} to {b:.0f})" for m, a, b in spread))
            print(f"{'  P':<28}" + "".join(f"{each:>6}{'':10}" for each in printed))
            ratios = median_cm(found) / printed
            print(f"{'  ratio':<28}" + "".join(f"{each:>6.2f}{'':10}" for each in ratios))
            if what == "rms":
                figures += [
                    Figure(f"{way}, rms at checks in {axis}", median, "cm", "paper P", ratio, WITHIN_A_THIRD)
                    for axis, median, ratio in zip("xyz", median_cm(found), ratios, strict=True)
                ]
    print(row("A8 minus comparator, rms", median_cm(comparison.difference_rms)), " P", *P_DIFFERENCES[0])
    print(row("A8 minus comparator, largest", median_cm(comparison.difference_largest)), " P", *P_DIFFERENCES[1])
    for way in P_TABLE:
        plan, height = np.median(getattr(comparison, way).closing, axis=1)
        print(f"{way} closing differences, mm in the picture: plan {plan:.4f}, height {height:.4f}; P {P_CLOSING}")
    return figures


def single_errors(seeds):
    print(f"\nrms, cm, medians over {len(seeds)} seeds      comparator x, y, z         A8 x, y, z")
    for name, overrides in CHANGES.items():
        comparison = compare_a8_to_comparator(load_scenario("a8-strip", overrides), seeds)
        both = np.concatenate([median_cm(comparison.comparator.rms), median_cm(comparison.a8.rms)])
        print(row(name, both, 6), flush=True)


def main():
    asked = [int(each) for each in sys.argv[1:]]
    seeds, fewer = (*asked, *(200, 100)[len(asked) :])
    began = time.perf_counter()
    figures = whole_table(compare_a8_to_comparator(load_scenario("a8-strip"), range(1, seeds + 1)))
    print(f"{time.perf_counter() - began:.1f} s")
    if fewer:
        single_errors(range(1, fewer + 1))
    return figures


if __name__ == "__main__":
    tell(main)
