#!/usr/bin/env python3
"""What a process model costs whose speeds are written in Python, against the built-in model of the same speeds:
    PYTHONPATH=BUILD/python tests/bench/python_law_bench.py [PAIRS, 15] [TWIN...]
Runs both in one process, in turn, and whichever goes first changes from pair to pair. First checks that both end at the same
surface, within a thousandth of a cell: a rate in Python may be rounded otherwise. Prints medians of wall seconds, and the median
ratio of the pairs with its quartiles, of wall and of CPU time; ends with 1 if a median ratio of wall time is above 1.05.
"""

import statistics
import sys
import time
from pathlib import Path

import numpy as np

import sidewall

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
MOST = 1.05
SAME = 1e-3  # largest distance of the surfaces, in cells

# Ion-assisted etching: the law of docs/examples/custom_model.py, as a formula.
ION_ASSISTED = {
    "domain": {"extent": [2.0, 0.8], "grid_spacing": 0.05, "boundary": ["reflective", "periodic"]},
    "layer": [{"material": "Si"}, {"material": "Mask", "shape": "trench", "thickness": 0.3, "width": 1.0}],
    "step": [
        {
            "model": "formula",
            "duration": 1.0,
            "species": [
                {"name": "neutral", "sticking": {"default": "0.3"}},
                {"name": "ion", "kind": "ion", "source_exponent": 100.0},
            ],
            "rate": {"Si": "-ion*neutral/max(ion + neutral, 1e-12)"},
        }
    ],
    "flux": {"rays": 100_000},
}


def ion_assisted(points):
    ions, neutrals = points.fluxes["ion"], points.fluxes["neutral"]
    speed = -ions * neutrals / np.maximum(ions + neutrals, 1e-12)
    return np.where(points.material == points.materials["Si"], speed, 0.0)


TWINS = {
    "deposition": (CONFIGS / "quick" / "trench_deposition.toml", lambda points: 1.0 * points.fluxes["neutral"]),
    "ion_assisted": (ION_ASSISTED, ion_assisted),
}


def run(recipe, law):
    """Wall and CPU seconds, and the surface at the end."""
    began = time.perf_counter(), time.process_time()
    for step in sidewall.Simulation(recipe, law=law):
        pass
    seconds = time.perf_counter() - began[0], time.process_time() - began[1]
    return seconds, step.surface()


def require_same(name, recipe, law):
    (_, built_in), (_, own) = run(recipe, None), run(recipe, law)
    cells = sidewall.distance(*built_in, *own).max / sidewall.Recipe(recipe)["domain.grid_spacing"]
    print(f"{name}: surfaces of {len(own.points)} points, {cells:.1e} cells apart")
    if not cells <= SAME:
        sys.exit(f"{name}: the law is no twin of the built-in model")


def ratio_text(ratios):
    low, _, high = statistics.quantiles(ratios, n=4, method="inclusive")
    return f"{statistics.median(ratios):.3f} ({low:.3f} to {high:.3f})"


def compare(name, recipe, law, pairs):
    require_same(name, recipe, law)  # also warms both up
    seconds = {None: [], law: []}
    for pair in range(pairs):
        for which in (None, law) if pair % 2 == 0 else (law, None):
            seconds[which].append(run(recipe, which)[0])
    built_in, own = np.array(seconds[None]), np.array(seconds[law])
    ratios = own / built_in
    print(f"{name}: built in {np.median(built_in[:, 0]):.3f} s, Python {np.median(own[:, 0]):.3f} s; median ratio of "
          f"{pairs} pairs and quartiles: {ratio_text(ratios[:, 0])}, of CPU time {ratio_text(ratios[:, 1])}")
    return float(np.median(ratios[:, 0]))


if __name__ == "__main__":
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else 15
    chosen = sys.argv[2:] or list(TWINS)
    if pairs < 2 or not set(chosen) <= set(TWINS):
        sys.exit(f"{__doc__}\n2 pairs or more; twins: {', '.join(TWINS)}")
    sys.exit(any([compare(name, *TWINS[name], pairs) > MOST for name in chosen]))
