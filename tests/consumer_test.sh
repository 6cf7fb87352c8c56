#!/usr/bin/env bash
# consumer_test.sh BUILD FOLDER: installs the build into FOLDER/prefix, and builds and runs there a program that uses one
# library alone, for each of them.
set -euo pipefail
build=$1 folder=$(realpath -m "$2")
here=$(dirname "$(realpath "${BASH_SOURCE[0]}")")

fail() { echo "consumer_test.sh: $*" >&2; exit 1; }

rm -rf "$folder"
mkdir -p "$folder"
cmake --install "$build" --prefix "$folder/prefix" >"$folder/install.log" || { cat "$folder/install.log"; exit 1; }

# An installation that was moved finds its files at the new place.
mv "$folder/prefix" "$folder/moved"
prefix=$folder/moved
"$prefix/bin/sidewall" check --no-estimate "$prefix/share/sidewall/configs/quick/trench_deposition.toml" >/dev/null
(cd / && "$prefix/bin/sidewall" validate --list >"$folder/cases.txt")  # to a file: a pipe closed early would end the program
grep -q '^even_film ' "$folder/cases.txt"
for file in share/man/man1/sidewall.1 share/bash-completion/completions/sidewall share/zsh/site-functions/_sidewall \
            share/fish/vendor_completions.d/sidewall.fish share/doc/sidewall/README.md share/doc/sidewall/docs/tutorial.md \
            share/doc/sidewall/LICENSE; do
    [ -s "$prefix/$file" ] || fail "$file was not installed"
done
bash -n "$prefix/share/bash-completion/completions/sidewall"

# consumer LIBRARY [PACKAGE...]: builds and runs it while CMake does not find PACKAGEs that it does not need.
consumer() {
    local library=$1 without=() package
    shift
    for package in "$@"; do without+=("-DCMAKE_DISABLE_FIND_PACKAGE_$package=ON"); done
    local at=$folder/$library
    { cmake -G Ninja -S "$here/consumer" -B "$at" -DLIBRARY="$library" -DCMAKE_PREFIX_PATH="$prefix" \
        -DCMAKE_CXX_FLAGS=-O0 "${without[@]}" && cmake --build "$at" -j 2; } >"$at.log" 2>&1 || { cat "$at.log"; exit 1; }
    (cd "$at" && ./consumer) || fail "the consumer of $library ended with $?"
    if grep -qE -- '-frounding-math|-march|-Wconversion|-fno-|-flto|cmake_pch' "$at/compile_commands.json"; then
        fail "flags of ours reached the consumer of $library: $(grep command "$at/compile_commands.json")"
    fi
}

# needs_no LIBRARY PATTERN: the consumer of LIBRARY is linked with no library that matches PATTERN.
needs_no() {
    if objdump -p "$folder/$1/consumer" | grep NEEDED | grep -E "$2"; then fail "the consumer of $1 needs these"; fi
}

consumer simplify OpenVDB embree CGAL ZLIB EXPAT PNG Boost
needs_no simplify 'openvdb|embree|gmp|libz|expat|boost'
consumer flux OpenVDB CGAL ZLIB EXPAT PNG Boost
needs_no flux 'openvdb|gmp|libz|expat|boost'
consumer surface OpenVDB CGAL PNG Boost
needs_no surface 'openvdb|gmp|boost'
consumer levelset CGAL PNG
if cmake -G Ninja -S "$here/consumer" -B "$folder/nonsense" -DLIBRARY=nonsense -DCMAKE_PREFIX_PATH="$prefix" \
    >"$folder/nonsense.log" 2>&1; then
    fail "a component that does not exist was found"
fi
rm -rf "$folder"
