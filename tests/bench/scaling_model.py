#!/usr/bin/env python3
"""What a recipe's phases cost on one thread, and what ranks would make of it:
    tests/bench/scaling_model.py BUILD RECIPE [--set KEY=VALUE ...] [--latency SECONDS --bandwidth BYTES_A_SECOND]
Runs the recipe on one thread with its rays and with a quarter of them, which tells what of a trace grows with the rays and is
shared, and what every rank does; measures a sum of MPI on two ranks, unless told those of a network; prints the tables of docs/scaling.md.
"""

import argparse
import json
import math
import os
import re
import subprocess
import sys
import tempfile

BLOCK = 1024  # rays that a rank takes at a time: flux/tracer/packets.hpp
BATCHES = 32


def run(program, recipe, settings, folder):
    """Summary of a run, CPU seconds in place of wall seconds: as much is other people's on a busy machine."""
    command = [f"{program}/sidewall", "run", recipe, "--threads", "1", "--quiet", "--overwrite", "-o", folder]
    for setting in settings:
        command += ["--set", setting]
    before = os.times()
    subprocess.run(command, check=True, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = os.times()
    summary = json.load(open(f"{folder}/summary.json"))
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    share = cpu / summary["timing"]["total"]
    return summary, {phase: seconds * share for phase, seconds in summary["timing"].items()}, share


def measured_sums(program):
    """Latency of a sum over two ranks on this machine, and seconds a byte of a large one."""
    text = subprocess.run(
        ["mpirun", "--oversubscribe", "--allow-run-as-root", "-n", "2", f"{program}/bench/mpi_sums_bench"],
        check=True, capture_output=True, text=True).stdout
    rows = [list(map(float, line.split()[:2])) for line in text.splitlines() if re.match(r"\d", line)]
    print(text)
    return rows[0][1], rows[-1][1] / rows[-1][0]  # latency; and seconds a byte of a sum too large for caches


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build")
    parser.add_argument("recipe")
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--latency", type=float)
    parser.add_argument("--bandwidth", type=float)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        whole, cost, share = run(arguments.build, arguments.recipe, arguments.set, f"{folder}/whole")
        rays = whole["flux"][0]["rays"]
        quarter, less, _ = run(arguments.build, arguments.recipe, [*arguments.set, f"flux.rays={rays // 4}"], f"{folder}/less")
    if arguments.latency:
        latency, per_byte = arguments.latency, 1.0 / arguments.bandwidth
    else:
        latency, per_byte = measured_sums(arguments.build)
    steps = whole["time_steps"]
    # The summary counts only time steps; the surface at the end is traced, too.
    traces = steps + 1
    slope = (cost["trace"] / traces - less["trace"] / (quarter["time_steps"] + 1)) / (rays - rays // 4)
    shared = slope * rays
    passes = sum(f["pass_place"] == 0 for f in whole["flux"])
    own = (cost["total"] - cost["trace"]) / traces + cost["trace"] / traces - shared * passes
    mesh = whole["mesh"]["simplified"]
    words = BATCHES * (mesh["triangles"] + 1.3 * mesh["vertices"]) * passes  # wedges: vertices split at creases
    print(f"{arguments.recipe} {' '.join(arguments.set)}: {steps} time steps, {rays} rays a pass, {passes} passes, "
          f"{whole['mesh']['raw']['triangles']} triangles, {mesh['triangles']} traced; CPU over wall {share:.2f}")
    print("\n| phase | CPU ms a time step | share |\n|---|---|---|")
    for phase in cost:
        if phase != "total":
            print(f"| {phase} | {1e3 * cost[phase] / traces:.1f} | {100 * cost[phase] / cost['total']:.1f} % |")
    print(f"\nshared by ranks {1e3 * shared * passes:.1f} ms ({1e6 * slope:.3f} us a ray), done by each {1e3 * own:.1f} ms, "
          f"summed {8e-6 * words:.2f} MB a time step; a sum: {1e6 * latency:.1f} us and {1e-9 / per_byte:.2f} GB/s")
    blocks = BATCHES * math.ceil(rays / BATCHES / BLOCK)

    def seconds(ranks, surface=1.0, rays_factor=1.0):
        """Of a time step with the surface and the rays so many times as large."""
        n = blocks * rays_factor
        trace = shared * passes * rays_factor * math.ceil(n / ranks) / n
        sums = 0.0 if ranks == 1 else 2 * latency * math.ceil(math.log2(ranks)) * passes + 2 * (
            ranks - 1) / ranks * 8 * words * surface * per_byte
        return own * surface + trace + sums, sums

    print("\n| ranks | speed-up, this run | efficiency | in sums | speed-up, 100 times the rays | surface and rays grow with "
          "the ranks: efficiency | rays alone grow |\n|---|---|---|---|---|---|---|")
    one, many = seconds(1)[0], seconds(1, 1.0, 100.0)[0]
    for ranks in (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024):
        time, sums = seconds(ranks)
        print(f"| {ranks} | {one / time:.2f} | {100 * one / time / ranks:.0f} % | {100 * sums / time:.1f} % | "
              f"{many / seconds(ranks, 1.0, 100.0)[0]:.1f} | {100 * one / seconds(ranks, ranks, ranks)[0]:.0f} % | "
              f"{100 * one / seconds(ranks, 1.0, ranks)[0]:.0f} % |")


sys.exit(main())
