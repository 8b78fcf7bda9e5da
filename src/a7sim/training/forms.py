"""Computation forms of numerical relative orientation: multipliers of the parallaxes at regular points."""

import numpy as np

from a7sim.geometry import GON, PARALLAX_ELEMENTS, Array, near_vertical_parallax_coefficients
from a7sim.reduction.least_squares import solve_least_squares
from a7sim.scenario import Scenario
from a7sim.standard_points import CASES, PLACES

FIVE_ELEMENTS = ("kappa1", "kappa2", "phi1", "phi2", "omega1")
"""Elements of swing-swing, 1 for the left-hand photograph."""


def multipliers(scenario: Scenario, case: str) -> Array:
    """Return the corrections in gon of the five elements per mm of parallax ``(5, n)``, at the points of a case.

    They are the least-squares solution of T 2.34 for regular points below vertical photographs.
    """
    plan = scenario.plan
    width = plan.half_width * plan.projection_height / scenario.camera.c
    x, y = np.array([PLACES[label] for label in CASES[case]]).T * np.array([plan.bx, width])[:, None]
    coefficients = near_vertical_parallax_coefficients(x, y, plan.projection_height, plan.bx)
    design = coefficients[[PARALLAX_ELEMENTS.index(name) for name in FIVE_ELEMENTS]].T
    solved = [solve_least_squares(design, -each).unknowns for each in np.eye(len(x))]
    return np.asarray(solved).T / GON


def computation_form(scenario: Scenario, case: str) -> str:
    """Return the form of a case as plain text: one line per point to be filled in."""
    heads = ("kappa'", 'kappa"', "phi'", 'phi"', "omega'")
    lines = [
        f"Numerical relative orientation, case {case}: kappa', kappa\", phi', phi\", omega'",
        "",
        "1. p = (mean of by' - mean of by\") / 2 at every point, in mm, with its sign.",
        "2. m = sum of all p / their number. v = p - m at every point.",
        "3. Multiply v by the number in every column, with its sign, and add the columns up: the corrections in gon.",
        "4. New setting = old setting + correction.",
        "",
        "point      by'      by\"        p        v " + "".join(f"{head:>10}" for head in heads),
    ]
    lines += [
        f"{label:<5}" + " ........" * 4 + " " + "".join(f"{factor:>+10.3f}" for factor in factors)
        for label, factors in zip(CASES[case], multipliers(scenario, case).T, strict=True)
    ]
    return "\n".join([*lines, f"{'':<24}sum / m: ........  corrections:" + "  ........" * 5, ""])
