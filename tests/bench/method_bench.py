#!/usr/bin/python3
"""What flux.method = "auto" takes of the CPU time of "monte-carlo" in whole recipes, at the same flux error:
    tests/bench/method_bench.py BUILD [-n RUNS, 3] [-v] [RECIPE[=RELATIVE_ERROR]...]
Both run each recipe with that flux.relative_error, on one thread and in turn, so that every species comes with both methods to
the error asked for; by default to about the error that the recipe's own rays leave Monte Carlo. Prints for each recipe
- CPU seconds of both, medians, and the median ratio of the pairs
- that ratio at equal errors: the tracing of Monte Carlo times the square of its reported error over that of auto
- the relative error that the runs report, its worst species, in the mean over the time steps
- the same on the first surface as two seeds tell it: the mean difference of the fluxes over the mean flux, of the worst tally
- the depth or the film that the runs end with, in the mean over their seeds, for both methods
With -v also the phases of both runs, and what took which method.
"""

import csv
import json
import math
import statistics
import struct
import sys
import tempfile
import xml.etree.ElementTree as xml
import zlib
from pathlib import Path

import numpy as np

from used import cpu_seconds_of

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
# The relative error that the recipe's own rays leave, and overrides that make its runs short enough.
RECIPES = {
    "sf6o2_hole": (0.04, []),
    "fluorocarbon_contact": (0.03, []),
    "bosch_hole": (0.025, ["step[0].repeat=4"]),
    "bosch_trench": (0.04, []),
    "hole_deposition": (0.01, []),
    "ald_hole": (0.04, []),
}
METHODS = ("auto", "monte-carlo")


def arrays_of(path):
    """Arrays of a zlib-compressed VTP file, by section and name."""
    data = path.read_bytes()
    begin = data.index(b"<AppendedData")
    start = data.index(b"_", begin) + 1
    types = {"Float64": "d", "Float32": "f", "Int32": "i", "Int64": "q", "UInt8": "B"}
    arrays = {}
    for section in xml.fromstring(data[:begin] + b"</VTKFile>").find("PolyData/Piece"):
        for array in section:
            at = start + int(array.get("offset"))
            blocks = struct.unpack_from("<3Q", data, at)[0]
            sizes = struct.unpack_from(f"<{blocks}Q", data, at + 24)
            at += 24 + 8 * blocks
            raw = b""
            for length in sizes:
                raw += zlib.decompress(data[at : at + length])
                at += length
            arrays[section.tag, array.get("Name")] = np.frombuffer(raw, np.dtype(types[array.get("type")]))
    return arrays


def difference(one, other):
    """Mean difference of the fluxes at the vertices of two runs' first surfaces as a share of the mean flux, the most of all
    tallies; as the standard error of either, of two normal errors."""
    a, b = (arrays_of(folder / "traced_0000.vtp") for folder in (one, other))
    points = a["Points", "Points"].reshape(-1, 3).astype(float)
    corners = a["Polys", "connectivity"].reshape(-1, 3)
    edges = points[corners]
    areas = np.linalg.norm(np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0]), axis=1)
    area = np.bincount(corners.ravel(), np.repeat(areas, 3), len(points))
    tallies = [name for section, name in a if section == "PointData" and name.startswith("flux_") and "error" not in name]
    return max(
        (area * abs(a["PointData", name] - b["PointData", name])).sum() / (area * a["PointData", name]).sum()
        for name in tallies) * math.sqrt(math.pi) / 2.0


def run(program, recipe, method, error, seed, settings, folder):
    """CPU seconds, mean reported error, summary."""
    command = [program, "run", CONFIGS / f"{recipe}.toml", "--threads", "1", "--quiet", "--overwrite", "-o", folder]
    for setting in [f"flux.method={method}", f"flux.seed={seed}", *([f"flux.relative_error={error}"] if error else []), *settings]:
        command += ["--set", setting]
    seconds = cpu_seconds_of(command)
    with open(folder / "timeline.csv") as file:
        errors = [float(row["relative_error"]) for row in csv.DictReader(file) if row["relative_error"]]
    summary = json.loads((folder / "summary.json").read_text())
    return seconds, statistics.fmean(errors), summary


def compare(program, recipe, error, runs, settings, folder, verbose):
    seconds = {method: [] for method in METHODS}
    errors = {method: [] for method in METHODS}
    ends = {method: [] for method in METHODS}
    last = {}
    for seed in range(1, runs + 1):
        for method in METHODS if seed % 2 else METHODS[::-1]:
            taken, reported, last[method] = run(
                program, recipe, method, error, seed, settings, folder / f"{method}{seed}")
            seconds[method].append(taken)
            errors[method].append(reported)
            metrology = last[method]["metrology"]
            ends[method].append(metrology.get("film_bottom") or metrology["depth"])
    ratio = statistics.median(a / m for a, m in zip(*(seconds[method] for method in METHODS)))
    share = last["monte-carlo"]["timing"]["trace"] / last["monte-carlo"]["timing"]["total"]
    more = (statistics.fmean(errors["monte-carlo"]) / statistics.fmean(errors["auto"])) ** 2
    equal = ratio / (1.0 - share + share * more)
    line = f"{recipe:<22}{error or 'rays':>6} | "
    for method in METHODS:
        seeds = difference(folder / f"{method}1", folder / f"{method}2") if runs > 1 else float("nan")
        line += f"{statistics.median(seconds[method]):7.2f} s  {100 * statistics.fmean(errors[method]):5.2f} %  {100 * seeds:5.2f} %"
        line += f"  {statistics.fmean(ends[method]):9.5g} | "
    print(f"{line}{ratio:6.3f} {equal:6.3f}", flush=True)
    if not verbose:
        return
    for method in METHODS:
        timing = last[method]["timing"]
        print(f"    {method}: " + ", ".join(f"{phase} {taken:.2f}" for phase, taken in timing.items() if taken >= 0.05))
    for species in last["auto"]["flux"]:
        print(f"    {species['species']} by {species['method']}, {species['relative_error']:.3g}: {species.get('reason', '')}")


def main(words):
    if not words:
        sys.exit(__doc__)
    program, runs, verbose, chosen = Path(words[0]).resolve() / "sidewall", 3, False, []
    words = iter(words[1:])
    for word in words:
        if word == "-n":
            runs = int(next(words))
        elif word == "-v":
            verbose = True
        else:
            name, _, error = word.partition("=")
            chosen.append((name, error))
    print(f"{'recipe':<22}{'error':>6} | auto: CPU, error reported, of two seeds, depth or film | monte-carlo: the same | ratio, at equal errors")
    with tempfile.TemporaryDirectory() as folder:
        for name, error in chosen or [(name, "") for name in RECIPES]:
            usual, settings = RECIPES.get(name, (0.03, []))
            asked = None if error == "rays" else float(error) if error else usual
            rays = [] if asked is None else ["flux.max_rays=100000000"]
            compare(program, name, asked, runs, settings + rays, Path(folder), verbose)


main(sys.argv[1:])
