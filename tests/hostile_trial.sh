#!/usr/bin/env bash
# A run that is killed 36 times, meets 31 full disks and resumes beside 150 damaged files: nothing is lost, and no damage
# passes unnoticed into a result. By hand; takes minutes.
#   hostile_trial.sh BUILD_DIR SCRATCH
set -uo pipefail
[ $# -eq 2 ] || { sed -n '2,4s/^# //p' "$0" >&2; exit 2; }
build=$(cd "$1" && pwd) scratch=$2
program=$build/sidewall faults=$build/tests/sidewall_faults
rm -rf "$scratch"
mkdir -p "$scratch"
cd "$scratch"
cat >recipe.toml <<'RECIPE'
[domain]
extent = [2.0, 0.4]
grid_spacing = 0.1
boundary = ["reflective", "periodic"]
[[layer]]
material = "Si"
[[layer]]
material = "SiO2"
thickness = 0.2
[[step]]
model = "isotropic"
duration = 0.5
rate = -0.2
[output]
every = 0.1
profiles = ["y=0"]
RECIPE
run=(run recipe.toml --quiet -o out)
wrong=0
fail() { echo "WRONG: $*"; wrong=$((wrong + 1)); }

# Hash of a run's files without clock times, which checkpoints and summaries hold.
content() {
    (cd "$1" && { cat surface_*.vtp interface_*.vtp profile_*.csv timeline.csv recipe.toml surface.pvd; sort manifest.txt; } |
        sha256sum)
}

"$program" "${run[@]}" || exit 1
whole=$(content out)

ends_whole() {
    "$program" "${run[@]}" --resume >said.txt 2>&1 || fail "$1: exit code $? of --resume: $(cat said.txt)"
    [ "$(content out 2>/dev/null)" = "$whole" ] || fail "$1: another result"
}

for n in $(seq 1 8 281); do
    rm -rf out
    SIDEWALL_FAULT="kill $n" "$faults" "${run[@]}" >said.txt 2>&1
    [ $? -eq 137 ] || fail "operation $n does not come: no kill"
    ends_whole "killed at operation $n"
done
echo "36 kills: $wrong wrong"

before=$wrong
for n in $(seq 2 9 272); do
    rm -rf out
    SIDEWALL_FAULT="full $n" "$faults" "${run[@]}" >said.txt 2>&1
    code=$?
    [ $code -eq 5 ] || [ $code -eq 0 ] || fail "full at operation $n: exit code $code: $(cat said.txt)"
    [ $code -eq 0 ] || grep -q "No space left on device" said.txt || fail "full at operation $n: says $(cat said.txt)"
    ends_whole "full at operation $n"
done
echo "31 full disks: $((wrong - before)) wrong"

before=$wrong
rm -rf out
SIDEWALL_FAULT="kill 200" "$faults" "${run[@]}" >said.txt 2>&1
mv out killed
damaged=0
for file in checkpoint.vdb timeline.csv manifest.txt recipe.toml surface.pvd surface_0001.vtp; do
    for n in $(seq 1 25); do
        rm -rf out
        cp -r killed out
        python3 - "out/$file" "$n" <<'PYTHON'
import sys
path, n = sys.argv[1], int(sys.argv[2])
data = bytearray(open(path, "rb").read())
at = len(data) * n // 26
if n % 3 == 0:
    del data[at:]  # cut off
else:
    data[at] ^= 1 << n % 8
open(path, "wb").write(data)
PYTHON
        damaged=$((damaged + 1))
        "$program" "${run[@]}" --resume >said.txt 2>&1
        code=$?
        if [ $code -eq 0 ]; then
            # Surfaces of earlier times are not read again, and rows cut off the timeline's end may be written again.
            [ "$file" = surface_0001.vtp ] || [ -s said.txt ] || [ "$(content out)" = "$whole" ] ||
                fail "$file damaged ($n): another result without a word"
        elif [ $code -gt 5 ]; then
            fail "$file damaged ($n): exit code $code"
        fi
    done
done
echo "$damaged damaged files: $((wrong - before)) wrong"
[ $wrong -eq 0 ]
