#!/usr/bin/env bash
# Tests runs shared over the ranks of mpirun; exit code 77 with the reason where they cannot be made:
#   tests/mpi_test.sh bytes|failures|sweep BUILD FOLDER
# bytes: any number of ranks and threads, and a run resumed on another number, write what one process writes. failures: a
# full disk, a lost rank, a signal and an error on one rank end all of them, with a message. sweep: a lost rank loses no row.
set -euo pipefail

[ $# -eq 3 ] || { sed -n '2,5s/^# \?//p' "$0" >&2; exit 2; }
what=$1 build=$(cd "$2" && pwd) folder=$3
source=$(cd "$(dirname "$0")/.." && pwd)
command -v mpirun >/dev/null || { echo "skipped: there is no mpirun; install openmpi-bin"; exit 77; }
[ -e "$build/libsidewall_mpi.so" ] || { echo "skipped: the build has found no libopenmpi-dev"; exit 77; }
rm -rf "$folder" && mkdir -p "$folder" && cd "$folder"

# ranks COUNT COMMAND...: runs a command on COUNT ranks; allows more ranks than cores, and root in a container.
ranks() { local count=$1; shift; timeout -k 5 60 mpirun --oversubscribe --allow-run-as-root -n "$count" "$@" </dev/null; }
fail() { echo "$*" >&2; exit 1; }

# Compares all that two runs wrote but times and the counts of threads and ranks. Checkpoints hold a number that is drawn
# anew for each; runs resumed from them are compared instead.
same() {
    local file
    [ "$(ls "$1")" = "$(ls "$2")" ] || fail "$1 and $2 hold other files: $(ls "$1" "$2")"
    for file in "$1"/*; do
        case $file in
            *.vdb) ;;
            */summary.json) cmp <(facts "$1/summary.json") <(facts "$2/summary.json") || fail "$file and $2's differ" ;;
            *) cmp "$file" "$2/$(basename "$file")" || fail "$file and $2's differ" ;;
        esac
    done
}
facts() {
    python3 - "$1" <<'PYTHON'
import json, sys
summary = json.load(open(sys.argv[1]))
for key in ("timing", "threads", "ranks"):
    summary.pop(key, None)
print(json.dumps(summary, indent=1))
PYTHON
}

case $what in
bytes)
    # Neutrals from above; ions and neutrals that depend on each other, by rays and by radiosity; radiosity with coverages; a
    # round wafer with ions by rays and the neutrals of its coverages by radiosity.
    cp "$source"/configs/quick/{trench_deposition,formula_etch,ald_hole,contact_round}.toml .
    declare -A set=([trench_deposition]="--set step[0].duration=0.6" [formula_etch]="--set flux.method=radiosity --set step[0].duration=0.5" [ald_hole]="--set flux.method=radiosity --set step[0].duration=100" [contact_round]="--set step.etch.duration=2.0 --set step.liner.duration=0.2 --set step.fill.duration=0.1")
    for recipe in trench_deposition formula_etch ald_hole contact_round; do
        run="run $recipe.toml --quiet ${set[$recipe]}"
        "$build/sidewall" $run --threads 1 -o "$recipe.one"
        for count in 1 2 3 4; do
            for threads in 1 2; do
                [ "$count$threads" != 11 ] || continue
                ranks "$count" "$build/sidewall" $run --threads "$threads" -o "$recipe.other"
                same "$recipe.one" "$recipe.other"
                rm -r "$recipe.other"
            done
        done
    done
    # Killed on three ranks; resumed on one, and on two; by rays from above, and by radiosity.
    for resumed in "1 trench_deposition 0.2" "2 trench_deposition 0.2" "2 formula_etch 0.1"; do
        read -r count recipe every <<<"$resumed"
        run="run $recipe.toml --quiet ${set[$recipe]} --set output.every=$every"
        [ -e "$recipe.whole" ] || "$build/sidewall" $run -o "$recipe.whole"
        ! SIDEWALL_FAULT="kill 150" ranks 3 "$build/tests/sidewall_faults" $run -o "$recipe.killed" 2>log || fail "nothing was killed"
        [ -e "$recipe.killed/checkpoint.vdb" ] && [ ! -e "$recipe.killed/summary.json" ] &&
            awk -F, -v every="$every" 'END { exit !($3 >= every) }' "$recipe.killed/timeline.csv" || fail "$recipe: killed too early or too late"
        ranks "$count" "$build/sidewall" $run -o "$recipe.killed" --resume
        same "$recipe.whole" "$recipe.killed"
        rm -r "$recipe.killed"
    done
    ;;
failures)
    cat >long.toml <<'TOML'
domain = {extent = [2.0, 1.0], grid_spacing = 0.1}
layer = [{material = "Si", shape = "trench", width = 1.0, depth = 1.0}]
step = [{model = "single_particle", duration = 100.0, rate = 0.01, sticking = 0.5, deposit = "SiO2"}]
output = {every = 0.5}
flux = {rays = 200000}
TOML
    # Each rank writes its process id to a file.
    cat >rank.sh <<TEXT
#!/bin/sh
echo \$\$ >pid.\$OMPI_COMM_WORLD_RANK
[ "\$AWAY" != "\$OMPI_COMM_WORLD_RANK" ] || cd away
exec $build/sidewall "\$@"
TEXT
    chmod +x rank.sh
    await() { for _ in $(seq 200); do [ -e "$1" ] && return; sleep 0.1; done; fail "$1 does not appear"; }

    code=0; SIDEWALL_FAULT="full 40" ranks 2 "$build/tests/sidewall_faults" run long.toml -o full --quiet >log 2>&1 || code=$?
    [ $code = 5 ] || fail "a full disk ended with $code: $(cat log)"
    [ "$(grep -c 'check space' log)" = 1 ] || fail "a full disk: $(cat log)"

    ranks 3 ./rank.sh run long.toml -o lost --quiet >log 2>&1 & job=$!
    await lost/checkpoint.vdb; sleep 0.5; kill -KILL "$(cat pid.1)"
    code=0; wait $job || code=$?
    # Open MPI 5 breaks the line.
    [ $code = 137 ] && tr '\n' ' ' <log | grep -q 'rank 1 .*exited on *signal 9' || fail "a lost rank ended with $code: $(cat log)"

    # A signal to one rank stops all of them at the same time step, with a checkpoint; the run resumes from there.
    ranks 3 ./rank.sh run long.toml -o lost --quiet --resume >log 2>&1 & job=$!
    rm -f pid.2; await pid.2; sleep 2; kill -TERM "$(cat pid.2)"
    code=0; wait $job || code=$?
    [ $code = 130 ] && [ "$(grep -c 'go on with: sidewall run' log)" = 1 ] || fail "a stopped rank ended with $code: $(cat log)"

    # A rank that does not see the recipe, before it has joined the others; and one that does not see the checkpoint.
    mkdir away
    code=0; AWAY=1 ranks 2 ./rank.sh run long.toml -o away1 --quiet >log 2>&1 || code=$?
    [ $code = 3 ] && grep -q '^rank 1: sidewall: long.toml: .*no such file' log || fail "a recipe not seen by rank 1: $code: $(cat log)"
    cp long.toml away
    code=0; AWAY=1 ranks 2 ./rank.sh run long.toml -o lost --quiet --resume >log 2>&1 || code=$?
    [ $code = 3 ] && grep -q '^rank 1: sidewall: .*checkpoint.vdb' log || fail "a checkpoint not seen by rank 1: $code: $(cat log)"

    code=0; ranks 2 "$build/sidewall" run long.toml -o bad --set flux.rays=-1 >log 2>&1 || code=$?
    [ $code = 2 ] && [ "$(grep -c 'flux.rays = -1' log)" = 1 ] || fail "a bad recipe ended with $code: $(cat log)"
    code=0; ranks 2 "$build/sidewall" check long.toml >log 2>&1 || code=$?
    [ $code = 2 ] && grep -q 'work for one process' log || fail "check ended with $code: $(cat log)"
    ;;
sweep)
    cat >recipe.toml <<'TOML'
domain = {extent = [2.0, 0.5], grid_spacing = 0.1}
layer = [{material = "Si", shape = "trench", width = 1.0, depth = 1.0}]
step = [{model = "single_particle", duration = 0.5, rate = 1.0, sticking = 0.3, deposit = "SiO2"}]
flux = {rays = 100000}
TOML
    sweep="sweep recipe.toml --vary step[0].sticking=0.1:0.9:16 --jobs 1 --threads 1 --quiet"
    rows() { awk -F, 'NR == 1 {for (k = 1; k <= NF; k++) if ($k != "seconds") keep[k]} {for (k = 1; k <= NF; k++) if (k in keep) printf "%s,", $k; print ""}' "$1"; }
    "$build/sidewall" $sweep -o alone
    cat >rank.sh <<TEXT
#!/bin/sh
echo \$\$ >pid.\$OMPI_COMM_WORLD_RANK
exec $build/sidewall "\$@"
TEXT
    chmod +x rank.sh
    # A run that is killed is a row with its message; the others are complete, and --resume repeats it.
    ranks 2 ./rank.sh $sweep -o killed >log 2>&1 & job=$!
    for _ in $(seq 200); do [ -s pid.1 ] && child=$(cat "/proc/$(cat pid.1)/task/"*"/children" 2>/dev/null) && [ -n "$child" ] && break; sleep 0.05; done
    kill -KILL $child 2>/dev/null || true
    wait $job || fail "the sweep failed: $(cat log)"
    [ "$(grep -c ',ok$' killed/sweep.csv)" -ge 15 ] || fail "rows were lost: $(cat killed/sweep.csv)"
    ranks 2 "$build/sidewall" $sweep -o killed --resume
    cmp <(rows alone/sweep.csv) <(rows killed/sweep.csv) || fail "the sweep of two ranks has another table"
    # Both ranks have made runs, and a rank that is lost leaves its run to the other one.
    rm -f pid.*
    ranks 2 --enable-recovery ./rank.sh $sweep -o lost >log 2>&1 & job=$!
    for _ in $(seq 200); do [ -s pid.1 ] && child=$(cat "/proc/$(cat pid.1)/task/"*"/children" 2>/dev/null) && [ -n "$child" ] && break; sleep 0.05; done
    [ -n "$child" ] || fail "rank 1 has made no run"
    mpirun=$(ps -o ppid= -p "$(cat pid.0)")
    kill -KILL "$(cat pid.1)"
    while kill -0 "$(cat pid.0)" 2>/dev/null; do sleep 0.1; done
    kill -KILL $mpirun 2>/dev/null || true  # it may wait for the lost rank
    wait $job || true
    [ "$(grep -c ',ok$' lost/sweep.csv)" -ge 15 ] || fail "rows were lost with a rank: $(cat log lost/sweep.csv)"
    ranks 2 "$build/sidewall" $sweep -o lost --resume
    cmp <(rows alone/sweep.csv) <(rows lost/sweep.csv) || fail "the resumed sweep has another table"
    # A fit asks for the same runs, whichever rank makes them.
    fit="fit recipe.toml --set flux.rays=20000 --vary step[0].sticking=0.1:0.9 --target depth=1.1+-0.02 --max-runs 12 --jobs 1 --threads 1 --quiet"
    "$build/sidewall" $fit -o fit.alone
    ranks 2 "$build/sidewall" $fit -o fit.two
    cmp fit.alone/fit.json fit.two/fit.json || fail "the fit of two ranks has another result"
    ;;
*) fail "$what: bytes, failures or sweep" ;;
esac
