#!/usr/bin/python3
"""What a grid of several levels takes of the CPU time and memory of a uniform one, by the wafer's size:
    tests/bench/levels_bench.py BUILD [-n RUNS, 3] [RECIPE=configs/fin_on_wide_wafer.toml] [EXTENT...]
Extents are squares in the recipe's unit, by default 1000, 2000 and 4000. All runs are on one thread and in turn. Prints for each
extent and number of levels the medians of CPU seconds and of the peak memory, both also as shares of the uniform grid's (of the
memory also without what the program takes to tell its version, most of it libraries), and the voxels at the end.
"""

import json
import statistics
import sys
import tempfile
from pathlib import Path

from used import used_by

LEVELS = (1, 2, 3)


def run(program, recipe, extent, levels, folder):
    """CPU seconds, megabytes at the peak, voxels by level."""
    command = [program, "run", recipe, "--threads", "1", "--quiet", "--overwrite", "-o", folder,
               "--set", f"domain.extent=[{extent}, {extent}]", "--set", f"grid.levels={levels}"]
    used = used_by(command)
    summary = json.loads((folder / "summary.json").read_text())
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1e3, [level["voxels"] for level in summary["grid"]["levels"]]


def main(arguments):
    if not arguments:
        sys.exit(__doc__)
    program = Path(arguments.pop(0)) / "sidewall"
    runs = 3
    if arguments[:1] == ["-n"]:
        runs = int(arguments[1])
        arguments = arguments[2:]
    recipe = Path(__file__).resolve().parents[2] / "configs/fin_on_wide_wafer.toml"
    if arguments and arguments[0].endswith(".toml"):
        recipe = Path(arguments.pop(0))
    print(f"{'extent':>8}{'levels':>8}{'CPU s':>9}{'share':>7}{'MB':>7}{'share':>7}{'own':>7}  voxels, the finest first")
    program_memory = used_by([program, "--version"]).ru_maxrss / 1e3
    with tempfile.TemporaryDirectory() as folder:
        for extent in arguments or ["1000", "2000", "4000"]:
            turns = [[run(program, recipe, extent, levels, Path(folder) / "run") for levels in LEVELS] for _ in range(runs)]
            uniform = None
            for levels, results in zip(LEVELS, zip(*turns)):
                seconds, memory = (statistics.median(result[k] for result in results) for k in (0, 1))
                uniform = uniform or (seconds, memory)
                voxels = " + ".join(f"{n:.3g}" for n in results[0][2])
                print(f"{extent:>8}{levels:>8}{seconds:>9.2f}{seconds / uniform[0]:>7.2f}"
                      f"{memory:>7.0f}{memory / uniform[1]:>7.2f}"
                      f"{(memory - program_memory) / (uniform[1] - program_memory):>7.2f}  {voxels}", flush=True)


main(sys.argv[1:])
