#!/usr/bin/env bash
# How well `sidewall fit` finds hidden parameters. deposition, etch: three within 40 runs from five starts, of a deposition
# (sticking, rate, source exponent; from a profile) and of an etch (neutral and ion rate, ion exponent; from two profiles).
# intervals: how often the 95 % intervals hold the hidden values when the deposition's figures have errors of 0.5 %. noise: how
# often where the only error is the simulation's noise: fits with several seeds against four times the rays. By hand; takes minutes.
#   fit_starts.sh BUILD_DIR SCRATCH [deposition|etch] [START, 1 to 5]...
#   fit_starts.sh BUILD_DIR SCRATCH intervals [TRIALS, 20]
#   fit_starts.sh BUILD_DIR SCRATCH noise [SEEDS, 20]
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,8s/^# //p' "$0" >&2; exit 2; }
program=$(cd "$1" && pwd)/sidewall scratch=$2 assets=$(cd "$(dirname "$0")/assets" && pwd)
quick=$(cd "$(dirname "$0")/../configs/quick" && pwd)
kinds=(deposition etch) starts=(1 2 3 4 5) trials=0
[ $# -lt 3 ] || kinds=("$3")
[ $# -lt 4 ] || starts=("${@:4}")
if [ "${kinds[0]}" = intervals ]; then kinds=(deposition) starts=(5) trials=${4:-20}; fi
mkdir -p "$scratch"
cd "$scratch"

if [ "${kinds[0]}" = noise ]; then
    declare -A fits=(
        [tutorial]="trench_deposition.toml --set step[0].duration=0.5 --vary step[0].sticking=0.02:1:log
            --target step_coverage_bottom=0.55"
        [teos]="teos_two_precursors.toml --vary step[0].precursors[0].sticking=0.01:0.5:log --target step_coverage_bottom=0.65"
        [teos_rate]="teos_two_precursors.toml --vary step[0].precursors[0].sticking=0.01:0.5:log
            --vary step[0].precursors[0].rate=0.1:0.4:log --target step_coverage_bottom=0.65 --target film_top=0.3
            --target film_side=0.175"
    )
    seeds=${4:-20} bad=0
    for kind in "${!fits[@]}"; do
        for ((seed = 1; seed <= seeds + 6; ++seed)); do
            rm -rf "$kind-$seed"
            rays=()
            [ $seed -le $seeds ] || rays=(--set flux.rays=400000)
            read -r -d '' -a words <<<"${fits[$kind]}" || true
            "$program" fit "$quick/${words[0]}" "${words[@]:1}" --set "flux.seed=$((1000 * seed))" "${rays[@]}" \
                -o "$kind-$seed" --quiet
        done
        python3 - "$kind" "$seeds" <<'END' || bad=1
import json, statistics, sys
kind, seeds = sys.argv[1], int(sys.argv[2])
fits = [json.load(open(f"{kind}-{seed}/fit.json"))["parameters"] for seed in range(1, seeds + 7)]
good = True
for key in fits[0]:
    truth = statistics.mean(fit[key]["value"] for fit in fits[seeds:])
    ends = [fit[key]["interval95"] for fit in fits[:seeds]]
    held = sum(low is not None and low <= truth <= high for low, high in ends)
    width = statistics.median(high - low for low, high in ends if low is not None)
    good = good and held >= 0.9 * seeds
    print(f"{kind}, {key}: {held} of {seeds} intervals, {width:.3g} wide, hold {truth:.5g}")
sys.exit(not good)
END
    done
    exit $bad
fi

cat >deposition.toml <<'END'
[domain]
extent = [4.0, 1.0]
grid_spacing = 0.125
boundary = ["reflective", "periodic"]
[[layer]]
material = "Si"
shape = "trench"
width = 2.0
depth = 2.0
[[step]]
model = "single_particle"
duration = 0.5
rate = 1.0
sticking = 0.3
source_exponent = 1.0
deposit = "SiO2"
[flux]
rays = 100_000
[simplify]
method = "none"
[output]
profiles = ["y=0"]
[metrology]
measures = ["film"]
END
cp "$assets/fit_etch.toml" etch.toml

# Key, hidden value, bounds, and where the five starts lie between them, on a logarithmic scale.
declare -A parameters=(
    [deposition]='step[0].sticking 0.17 0.05 0.8 0.1 0.9 0.0 1.0 0.5
step[0].rate 1.1 0.5 2 0.1 0.9 1.0 0.0 0.5
step[0].source_exponent 1.6 1 4 0.1 0.9 0.5 1.0 0.5'
    [etch]='step[0].species[0].rate.Si -0.35 -1 -0.1 0.1 0.9 0.0 1.0 0.5
step[0].species[1].rate.Si -0.6 -1.5 -0.2 0.1 0.9 1.0 0.0 0.5
step[0].species[1].source_exponent 60 10 400 0.1 0.9 0.5 1.0 0.5')

bad=0
for kind in "${kinds[@]}"; do
    truth=() vary=()
    while read -r key value low high _; do
        truth+=(--set "$key=$value")
        vary+=(--vary "$key=$low:$high:log")
    done <<<"${parameters[$kind]}"
    rm -rf "$kind-truth"
    "$program" run "$kind.toml" "${truth[@]}" -o "$kind-truth" --quiet
    if [ "$kind" = deposition ] && [ $trials -eq 0 ]; then
        targets=(--target-profile "$kind-truth/profile_0001.csv@0.5")
    elif [ "$kind" = deposition ]; then
        targets=()
        for figure in film_top film_side film_bottom mean_rate; do
            targets+=(--target "$figure=$(python3 -c 'import json, sys
print(json.load(open(sys.argv[1]))["metrology"][sys.argv[2]])' "$kind-truth/summary.json" $figure)")
        done
    else
        targets=(--target-profile "$kind-truth/profile_0001.csv@1" --target-profile "$kind-truth/profile_0002.csv@2")
    fi
    if [ $trials -gt 0 ]; then
        for ((trial = 1; trial <= trials; ++trial)); do
            mapfile -t noisy < <(python3 - $trial "${targets[@]}" <<'END'
import random, sys
random.seed(int(sys.argv[1]))
for text in sys.argv[2:]:
    if text != "--target":
        name, value = text.split("=")
        text = f"{name}={random.gauss(float(value), 0.005 * float(value)):.8g}+-{0.005 * float(value):.8g}"
    print(text)
END
            )
            rm -rf "trial-$trial"
            "$program" fit "$kind.toml" "${vary[@]}" "${noisy[@]}" -o "trial-$trial" --quiet
        done
        python3 - $trials "${truth[@]}" <<'END'
import json, sys
trials = int(sys.argv[1])
hidden = dict(text.split("=") for text in sys.argv[2:] if text != "--set")
fits = [json.load(open(f"trial-{trial}/fit.json"))["parameters"] for trial in range(1, trials + 1)]
counts = {}
for key, value in hidden.items():
    ends = [fit[key]["interval95"] for fit in fits]
    counts[key] = sum(low is not None and low <= float(value) <= high for low, high in ends)
    print(f"{key}: {counts[key]} of {trials} intervals hold {value}")
sys.exit(any(count < 0.9 * trials for count in counts.values()))
END
        exit
    fi
    for start in "${starts[@]}"; do
        from=()
        while read -r key value low high places; do
            from+=(--set "$key=$(awk -v a="$low" -v b="$high" -v p="$(cut -d' ' -f "$start" <<<"$places")" \
                'BEGIN { printf "%.6g", a * (b / a) ^ p }')")
        done <<<"${parameters[$kind]}"
        rm -rf "$kind-$start"
        "$program" fit "$kind.toml" "${from[@]}" "${vary[@]}" "${targets[@]}" --max-runs 40 -o "$kind-$start" --quiet
        python3 - "$kind-$start/fit.json" "$kind from start $start" "${truth[@]}" <<'END' || bad=1
import json, sys
fit = json.load(open(sys.argv[1]))
hidden = dict(text.split("=") for text in sys.argv[3:] if text != "--set")
off = {key: fit["parameters"][key]["value"] / float(value) - 1 for key, value in hidden.items()}
print(sys.argv[2] + ":", fit["status"], "in", fit["runs"], "runs, off by",
      ", ".join(f"{100 * part:+.2f} %" for part in off.values()))
sys.exit(any(abs(part) > 0.02 for part in off.values()) or fit["status"] != "converged" or fit["runs"] > 40)
END
    done
done
exit $bad
