#!/usr/bin/env bash
# Sets Sidewall up on Debian 12 and runs it: ./setup.sh run [ARGS] | test | package | deps. See README.md.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

PACKAGES=(
    g++ cmake ninja-build
    libopenvdb-dev libboost-dev libboost-iostreams-dev libembree-dev libcgal-dev libtbb-dev libeigen3-dev
    librandom123-dev libtomlplusplus-dev libcli11-dev libfmt-dev nlohmann-json3-dev
    libpng-dev zlib1g-dev libexpat1-dev libmuparser-dev libnlopt-cxx-dev libpolyclipping-dev libjs-three catch2
)

PYTHON_PACKAGES=(pybind11-dev python3-dev)
PYTHON=(-DSIDEWALL_PYTHON=ON -DPython3_EXECUTABLE=/usr/bin/python3)  # Debian's, which these packages are for

usage() {
    cat <<'TEXT'
usage: ./setup.sh run [ARGS]   install what is missing, build, and run `sidewall run ARGS`
                               (no ARGS: configs/trench_deposition.toml)
       ./setup.sh test         the same, then all tests
       ./setup.sh package      build, and make Debian packages in build/package
       ./setup.sh deps         only install the Debian packages
TEXT
}

install_packages() {
    local missing=() package
    for package in "${PACKAGES[@]}"; do
        [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] && return
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || { echo "setup.sh: run as root, or install sudo: packages are missing: ${missing[*]}" >&2; exit 1; }
        as_root=(sudo)
    fi
    echo "setup.sh: installing Debian packages: ${missing[*]}" >&2
    "${as_root[@]}" apt-get update -qq
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

build() {
    cmake --preset release "$@" >build.log 2>&1 || { cat build.log >&2; exit 1; }
    rm build.log
    cmake --build --preset release
}

command=${1:-}
[ $# -gt 0 ] && shift
case "$command" in
    deps) install_packages ;;
    run)
        install_packages
        build -DSIDEWALL_TESTS=OFF -DSIDEWALL_PYTHON=OFF >&2
        [ $# -gt 0 ] || set -- configs/trench_deposition.toml
        exec build/release/sidewall run "$@"
        ;;
    test)
        PACKAGES+=("${PYTHON_PACKAGES[@]}" python3-numpy python3-pytest libopenmpi-dev openmpi-bin)
        install_packages
        build -DSIDEWALL_TESTS=ON "${PYTHON[@]}" ${SIDEWALL_CMAKE_ARGS:-}
        ctest --preset release ${SIDEWALL_CTEST_ARGS:-}
        ;;
    package)
        PACKAGES+=("${PYTHON_PACKAGES[@]}" dpkg-dev file)
        install_packages
        build -DSIDEWALL_TESTS=OFF "${PYTHON[@]}"
        rm -f build/package/*.deb
        cpack --config build/release/CPackConfig.cmake -B build/package
        rm -r build/package/_CPack_Packages
        ;;
    *)
        usage >&2
        exit 2
        ;;
esac
