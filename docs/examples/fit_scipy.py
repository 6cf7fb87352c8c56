"""Sticking and rate of a deposition from two measured figures, by SciPy's least squares.

`sidewall fit` does this without a script; here one sees how to drive any optimiser. The seed of the recipe stays the same, so that
the figures change smoothly with the parameters.
"""

import sys

import numpy as np

import sidewall
from step_coverage import TRENCH

MEASURED = {"film_top": 0.24, "film_bottom": 0.12}  # um


def residuals(parameters):
    sticking, rate = parameters
    recipe = sidewall.Recipe(TRENCH, {"step[0].sticking": float(sticking), "step[0].rate": float(rate)})
    for step in sidewall.Simulation(recipe):
        pass
    return [step.measures[name] - value for name, value in MEASURED.items()]


if __name__ == "__main__":
    try:
        from scipy.optimize import least_squares
    except ImportError:
        sys.exit("this example needs SciPy: apt-get install python3-scipy")
    # Differences of 5 % of the parameters stand out of what noise is left.
    fit = least_squares(residuals, [0.3, 1.0], bounds=([0.01, 0.1], [1.0, 10.0]), diff_step=0.05, xtol=1e-2)
    sticking, rate = fit.x
    print(f"sticking {sticking:.3f}, rate {rate:.3f} um/s after {fit.nfev} steps; misses {np.abs(fit.fun).max():.4f} um")
