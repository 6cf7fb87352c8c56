#!/usr/bin/python3
"""CPU seconds of whole recipes against the true error that noise leaves in their figures:
    tests/bench/time_to_error.py BUILD [-n SEEDS, 5] [RECIPE...]
Each quick recipe runs on one thread by its defaults, by its defaults at a flux.accuracy of 3 %, with monte-carlo on the surface as
extracted and a million rays, the default of version 0.2, and on coarsened meshes with a tenth of them. Prints for each
- CPU seconds, medians over the seeds
- the error: the largest of the figures' root mean square distances from the truth, as shares of it. The truth is the mean of two
  runs by monte-carlo with 100 times the work, a tenth of the default's flux.accuracy, on the same grid and coarsened likewise
- the scatter: the largest of the figures' standard deviations between seeds, and the largest noise that a run says it reached
Figures are those whose noise is that of a place that moves: depths, films, widths.
"""

import json
import math
import statistics
import sys
import tempfile
from pathlib import Path

from used import cpu_seconds_of

CONFIGS = Path(__file__).resolve().parents[2] / "configs/quick"
# Recipes with the figures to compare.
RECIPES = {
    "trench_deposition": ("film_top", "film_side", "film_bottom"),
    "trench_profile": ("film_top", "film_side", "film_bottom"),
    "hole_deposition": ("film_top", "film_side", "film_bottom"),
    "teos_trench": ("film_top", "film_side", "film_bottom"),
    "sf6o2_hole": ("depth", "cd_at_0.1", "cd_at_0.5"),
    "fluorocarbon_contact": ("depth", "cd_at_20", "cd_at_60"),
    "bosch_trench": ("depth",),
    "formula_etch": ("depth",),
}
BY_DEFAULT = ("flux.rays=0", "flux.method=auto", "simplify.method=auto")
BY_RAYS = ("flux.method=monte-carlo", "simplify.method=none")
WAYS = {
    "default": BY_DEFAULT,
    "accuracy 3 %": BY_DEFAULT + ("flux.accuracy=0.03",),
    "1e6 rays, raw": BY_RAYS + ("flux.rays=1000000",),
    "1e5 rays, coarsened": ("flux.method=monte-carlo", "simplify.method=region-bounded", "flux.rays=100000"),
}


def run(build, name, settings, seed):
    """CPU seconds, figures and the noise said to be reached."""
    with tempfile.TemporaryDirectory() as folder:
        command = [build / "sidewall", "run", CONFIGS / f"{name}.toml", "--quiet", "--threads", "1", "-o", Path(folder) / "out"]
        for setting in (*settings, f"flux.seed={seed}"):
            command += ["--set", setting]
        seconds = cpu_seconds_of([str(word) for word in command])
        summary = json.loads((Path(folder) / "out/summary.json").read_text())
    figures = {figure: summary["metrology"][figure] for figure in RECIPES[name] if figure in summary["metrology"]}
    return seconds, figures, summary.get("noise", {}).get("reached")


def main():
    words = sys.argv[1:]
    seeds = int(words.pop(words.index("-n") + 1)) if "-n" in words else 5
    words = [word for word in words if word != "-n"]
    build = Path(words[0]).resolve()
    print("| recipe | how | CPU time | error | scatter | said to be reached |\n|---|---|---|---|---|---|")
    for name in words[1:] or RECIPES:
        exact = [run(build, name, BY_DEFAULT + ("flux.method=monte-carlo", "flux.accuracy=0.001"), seed)[1] for seed in (901, 902)]
        truth = {figure: statistics.mean(one[figure] for one in exact) for figure in exact[0]}
        for way, settings in WAYS.items():
            runs = [run(build, name, settings, seed) for seed in range(1, seeds + 1)]
            error = scatter = 0.0
            for figure, true in truth.items():
                values = [figures[figure] for _, figures, _ in runs]
                error = max(error, math.sqrt(statistics.mean((v - true) ** 2 for v in values)) / abs(true))
                scatter = max(scatter, statistics.stdev(values) / abs(true))
            reached = [noise for _, _, noise in runs if noise is not None]
            said = f"{100 * max(reached):.2g} %" if reached else ""
            seconds = statistics.median(one[0] for one in runs)
            print(f"| `{name}` | {way} | {seconds:.2f} s | {100 * error:.2g} % | {100 * scatter:.2g} % | {said} |", flush=True)


main()
