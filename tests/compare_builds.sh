#!/usr/bin/env bash
# Runs every quick recipe with the programs of two built checkouts and compares what they write byte for byte:
#   tests/compare_builds.sh TREE_A TREE_B [RECIPE...]
# TREE/build/release/sidewall runs TREE/configs/quick/RECIPE.toml. Surfaces, interfaces, traced meshes, profiles and
# timelines must be equal; summaries hold seconds and are not compared. Exit code 0 if all are equal.
set -euo pipefail

[ $# -ge 2 ] || { sed -n '2,5s/^# \?//p' "$0" >&2; exit 2; }
trees=("$(cd "$1" && pwd)" "$(cd "$2" && pwd)")
shift 2
if [ $# -gt 0 ]; then recipes=("$@"); else
    recipes=()
    for file in "${trees[0]}"/configs/quick/*.toml; do recipes+=("$(basename "$file" .toml)"); done
fi
results=$(mktemp -d)
trap 'rm -rf "$results"' EXIT

different=0
for recipe in "${recipes[@]}"; do
    for side in 0 1; do
        (cd "${trees[side]}" && build/release/sidewall run "configs/quick/$recipe.toml" -o "$results/$side" --quiet) \
            >"$results/log" 2>&1 || { echo "$recipe: ${trees[side]} fails:"; cat "$results/log"; exit 1; }
    done
    unequal=$(cd "$results/0" && for file in *.vtp *.csv surface.pvd; do
        [ ! -e "$file" ] || cmp -s "$file" "../1/$file" || echo -n " $file"
    done)
    files=$(ls "$results/0" | wc -l)
    [ "$(ls -I manifest.txt "$results/0")" = "$(ls -I manifest.txt "$results/1")" ] || unequal+=" (other files)"
    if [ -z "$unequal" ]; then echo "$recipe: the same bytes in all of $files files"; else
        echo "$recipe: differs in$unequal"
        different=1
    fi
    rm -rf "$results"/[01]
done
exit $different
