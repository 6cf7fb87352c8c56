#!/usr/bin/env bash
# A sweep of a quick recipe over 64 Sobol points on 2 cores, once in one go, and once killed three times, with its runs,
# and resumed: 64 rows, no run made twice, the same bytes. By hand; takes minutes.
#   sweep_kill_test.sh BUILD_DIR SCRATCH [JOBS, 2]
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,4s/^# //p' "$0" >&2; exit 2; }
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
program=$(cd "$1" && pwd)/sidewall scratch=$2 jobs=${3:-2}
rm -rf "$scratch"
mkdir -p "$scratch"
cd "$scratch"
sweep=("$program" sweep "$source/configs/quick/trench_deposition.toml" --vary 'step[0].sticking=0.02:1:log'
    --vary 'step[0].rate=0.5:1.2' --design sobol --runs 64 --jobs "$jobs" --threads 2 --quiet)

rows() { if [ -e "$1/sweep.csv" ]; then tail -n +2 "$1/sweep.csv" | wc -l; else echo 0; fi; }

# Figures without the column of seconds, and the bytes of all surfaces, profiles and recipes; checkpoints hold clocks, too.
content() {
    awk -F, 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i == "seconds") s = i } { $s = ""; print }' "$1/sweep.csv"
    (cd "$1" && find runs -type f \( -name '*.vtp' -o -name 'profile_*.csv' -o -name recipe.toml \) -print0 |
        sort -z | xargs -0 sha256sum)
}

TIMEFORMAT='in one go: %R s, %U s of CPU time by users, %S s by the system'
time "${sweep[@]}" -o whole >/dev/null

interrupted() {
    local resume=() at
    for at in 8 24 44; do
        "${sweep[@]}" -o killed "${resume[@]}" >/dev/null &
        local sweep_id=$!
        until [ "$(rows killed)" -ge $at ]; do sleep 0.05; done
        kill -9 $sweep_id $(pgrep -P $sweep_id || true)
        wait $sweep_id 2>/dev/null || true
        echo "killed with $(rows killed) rows"
        resume=(--resume)
    done
    "${sweep[@]}" -o killed --resume >/dev/null
}
TIMEFORMAT='killed three times: %R s'
time interrupted

[ "$(rows whole)" -eq 64 ] && [ "$(rows killed)" -eq 64 ] || { echo "not 64 rows"; exit 1; }
[ "$(grep -c ',ok$' whole/sweep.csv)" -eq 64 ] || { echo "a run failed"; exit 1; }
content whole >whole.txt
content killed >killed.txt
cmp whole.txt killed.txt || { echo "the two differ"; exit 1; }
echo "64 rows and $(grep -c runs/ whole.txt) files alike"
