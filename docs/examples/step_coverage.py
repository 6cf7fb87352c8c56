"""Step coverage of a trench against the sticking probability, with a plot where matplotlib is installed.

python3 step_coverage.py [STICKING...]
"""

import sys
from pathlib import Path

import sidewall

TRENCH = {
    "domain": {"extent": [4.0, 0.5], "grid_spacing": 0.125, "boundary": ["reflective", "periodic"]},
    "layer": [{"material": "Si", "shape": "trench", "width": 2.0, "depth": 2.0}],
    "step": [{"model": "single_particle", "duration": 0.3, "rate": 1.0, "sticking": 0.1, "deposit": "SiO2"}],
    "flux": {"rays": 20_000},
    "metrology": {"measures": ["film"]},
}


def step_coverage(sticking):
    """Film at the floor over film on top."""
    recipe = sidewall.Recipe(TRENCH, {"step[0].sticking": sticking})
    for step in sidewall.Simulation(recipe):
        pass
    return step.measures["step_coverage_bottom"]


def plot(stickings, coverages, file):
    try:
        import matplotlib

        matplotlib.use("Agg")  # needs no display
        import matplotlib.pyplot as plt
    except ImportError:
        print("no matplotlib: no plot")
        return
    plt.semilogx(stickings, coverages, "o-")
    plt.xlabel("sticking probability")
    plt.ylabel("step coverage at the floor")
    plt.ylim(0, 1)
    plt.savefig(file)
    print("plot in", file)


if __name__ == "__main__":
    stickings = [float(word) for word in sys.argv[1:]] or [0.03, 0.1, 0.3, 1.0]
    coverages = [step_coverage(sticking) for sticking in stickings]
    print("sticking  step coverage")
    for sticking, coverage in zip(stickings, coverages):
        print(f"{sticking:8.3g}  {coverage:.3f}")
    plot(stickings, coverages, Path("step_coverage.png"))
