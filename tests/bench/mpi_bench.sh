#!/usr/bin/env bash
# Cost of MPI ranks against threads, in pairs of runs: 1 rank of 2 threads, then 2 ranks of 1 thread:
#   tests/bench/mpi_bench.sh BUILD RECIPE [PAIRS [SETTING...]]
# A setting is KEY=VALUE. Prints for each pair the wall seconds of both runs (the summary's timing.total), the
# efficiency (first over second), CPU seconds, and the share of the second run in sums over the ranks, waiting
# included; and the medians.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,6s/^# \?//p' "$0" >&2; exit 2; }
program=$1/sidewall recipe=$2 pairs=${3:-3}
shift $(($# < 3 ? $# : 3))
settings=()
for setting in "$@"; do settings+=(--set "$setting"); done
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# Runs a command, and writes its user and system seconds to a file.
timed() { local file=$1; shift; TIMEFORMAT='%U %S'; { time "$@" >"$folder/log" 2>&1 </dev/null; } 2>"$file"; }

for pair in $(seq "$pairs"); do
    timed "$folder/cpu1" "$program" run "$recipe" "${settings[@]}" --threads 2 --quiet --overwrite -o "$folder/threads"
    timed "$folder/cpu2" mpirun --oversubscribe --allow-run-as-root --bind-to none -n 2 \
        "$program" run "$recipe" "${settings[@]}" --threads 1 --quiet --overwrite -o "$folder/ranks"
    python3 - "$folder" <<'PYTHON'
import json, sys
folder = sys.argv[1]
one, two = (json.load(open(f"{folder}/{name}/summary.json")) for name in ("threads", "ranks"))
cpu = [sum(map(float, open(f"{folder}/cpu{k}").read().split())) for k in (1, 2)]
t1, t2 = one["timing"]["total"], two["timing"]["total"]
print(f"{t1:.2f} {t2:.2f} {t1 / t2:.3f} {cpu[0]:.1f} {cpu[1]:.1f} {two['ranks']['seconds_in_sums'] / t2:.4f} "
      f"{one['timing']['trace'] / t1:.3f}")
PYTHON
done | tee "$folder/pairs" | awk '{printf "1 x 2: %s s wall, %s s CPU (%.0f %% tracing); 2 x 1: %s s wall, %s s CPU; efficiency %.3f; in sums %.1f %%\n", $1, $4, 100 * $7, $2, $5, $3, 100 * $6; fflush()}'
median() { cut -d' ' -f"$1" "$folder/pairs" | sort -n | awk '{v[NR] = $1} END {print NR % 2 ? v[(NR + 1) / 2] : (v[NR / 2] + v[NR / 2 + 1]) / 2}'; }
awk '{one += $4; two += $5} END {printf "CPU seconds of all 1 x 2 over those of all 2 x 1, which spin while they wait: %.3f\n", one / two}' "$folder/pairs"
echo "median efficiency $(median 3), median share in sums $(median 6)"
