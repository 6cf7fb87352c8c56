#!/usr/bin/env bash
# clang-tidy on the product's sources, twenty at a time, so that headers are read once for all. Sources that cannot share a
# file (two may each have a local name of their own) and those with findings are then checked one by one: only what that
# reports counts.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
for preset in tidy tidy-unity; do
    cmake --preset "$preset" >"build/$preset.log" 2>&1 || { cat "build/$preset.log"; exit 1; }
done

together() {
    clang-tidy -p build/tidy-unity --quiet --checks=-bugprone-suspicious-include "$1" >/dev/null 2>&1 ||
        grep -o '#include "[^"]*"' "$1" | cut -d'"' -f2
}
export -f together
find build/tidy-unity -path '*/Unity/unity_*_cxx.cxx' | sort | xargs -P "$(nproc)" -I{} bash -c 'together {}' >build/tidy.list
# Sources that are in no unity file.
comm -23 <(git ls-files 'surface/*.cpp' 'levelset/*.cpp' 'simplify/*.cpp' 'flux/*.cpp' 'app/*.cpp' | sort) \
    <(find build/tidy-unity -path '*/Unity/unity_*_cxx.cxx' -exec grep -ho '#include "[^"]*"' {} + | cut -d'"' -f2 |
        sed "s|^$PWD/||" | sort) >>build/tidy.list
echo "$(git ls-files 'surface/*.cpp' 'levelset/*.cpp' 'simplify/*.cpp' 'flux/*.cpp' 'app/*.cpp' | wc -l) sources, $(wc -l <build/tidy.list) of them one by one"
xargs -r -P "$(nproc)" -n 4 clang-tidy -p build/tidy --quiet <build/tidy.list 2>build/tidy.log ||
    { grep -v 'warnings generated' build/tidy.log | tail -40; exit 1; }
