#!/usr/bin/python3
"""What `auto` takes of the CPU time of the better method in a trench of aspect ratio 2 at sticking 0.1:
    tests/bench/auto_bench.py BUILD [-n SEEDS, 5] [RELATIVE_ERROR...]
`sidewall flux` on the trench as a level set of 20 cells a width gives it, and simplified; then `sidewall run` of a film in it. All
on one thread and in turn; medians over the seeds of the least of three turns, loading of the program and reading of the mesh
included.
"""

import statistics
import sys
import tempfile
from pathlib import Path

from used import cpu_seconds_of

METHODS = ("monte-carlo", "radiosity", "auto")
TURNS = 3  # repeats of the same work, as other load on the machine slows some
ERRORS = ("0.1", "0.07", "0.05", "0.03", "0.02", "0.01", "0.005")
TRENCH = """
[domain]
extent = [2.0, 2.0]
grid_spacing = 0.05
[[layer]]
material = "Si"
shape = "trench"
width = 1.0
depth = 2.0
[[step]]
model = "single_particle"
duration = 6.0
rate = 0.02
sticking = 0.1
deposit = "SiO2"
[flux]
rays = 10000
"""


def compare(name, error, seeds, command):
    least = []
    for seed in range(1, seeds + 1):
        turns = [[cpu_seconds_of(command(method, error, seed)) for method in METHODS] for _ in range(TURNS)]
        least.append([min(column) for column in zip(*turns)])
    medians = [statistics.median(column) for column in zip(*least)]
    print(f"{name:<12}{error:>7}" + "".join(f"{seconds:12.3f}" for seconds in medians) + f"{medians[2] / min(medians[:2]):8.2f}",
          flush=True)


def main(arguments):
    if not arguments:
        sys.exit(__doc__)
    program = Path(arguments.pop(0)) / "sidewall"
    seeds = 5
    if arguments[:1] == ["-n"]:
        seeds = int(arguments[1])
        arguments = arguments[2:]
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        recipe = folder / "trench.toml"
        recipe.write_text(TRENCH)
        cpu_seconds_of([program, "run", recipe, "--quiet", "-o", folder / "run"])
        raw, simplified = folder / "run/surface_0000.vtp", folder / "simplified.vtp"
        cpu_seconds_of([program, "simplify", raw, "-o", simplified, "--grid-spacing", "0.05"])
        print(f"{'':12}{'error':>7}" + "".join(f"{method:>12}" for method in METHODS) + "   auto / better")
        for error in arguments or ERRORS:
            for mesh in (raw, simplified):
                compare(mesh.stem if mesh == simplified else "raw", error, seeds, lambda method, error, seed: [
                    program, "flux", mesh, "--sticking", "0.1", "--boundary", "periodic", "--relative-error", error, "--method",
                    method, "--seed", seed, "--threads", "1"])
            compare("recipe", error, seeds, lambda method, error, seed: [
                program, "run", recipe, "--quiet", "--overwrite", "-o", folder / "run", "--threads", "1", "--set",
                f"flux.relative_error={error}", "--set", f"flux.method={method}", "--set", f"flux.seed={seed}"])


if __name__ == "__main__":
    main(sys.argv[1:])
