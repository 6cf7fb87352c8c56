#!/usr/bin/env bash
# Sets Sidewall up on Debian 12, Debian 13 and Ubuntu 24.04: ./setup.sh run [ARGS] | test | package | archive | wheel | deps.
# See docs/installing.md.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

PACKAGES=(
    g++ cmake ninja-build
    libopenvdb-dev libboost-dev libboost-iostreams-dev libembree-dev libcgal-dev libtbb-dev libeigen3-dev
    librandom123-dev libtomlplusplus-dev libcli11-dev libfmt-dev nlohmann-json3-dev
    libpng-dev zlib1g-dev libexpat1-dev libmuparser-dev libnlopt-cxx-dev libpolyclipping-dev libjs-three libjs-codemirror catch2
)

PYTHON_PACKAGES=(pybind11-dev python3-dev)
PYTHON=(-DSIDEWALL_PYTHON=ON -DPython3_EXECUTABLE=/usr/bin/python3)  # the system's, which these packages are for

usage() {
    cat <<'TEXT'
usage: ./setup.sh run [ARGS]   install what is missing, build, and run `sidewall run ARGS`
                               (no ARGS: configs/trench_deposition.toml)
       ./setup.sh test         the same, then all tests
       ./setup.sh package      build, and make packages for this system in build/package
       ./setup.sh archive      build, and make an archive for any Linux with this system's glibc or a newer one
       ./setup.sh wheel        build, and make a wheel for this system's Python
       ./setup.sh deps         only install the system's packages
TEXT
}

say() { echo "setup.sh: $*" >&2; }

# apt-get as root; it waits ten minutes for another package manager to end.
as_root_apt() {
    local as_root=() log waited=0
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || { say "run as root, or install sudo: packages are missing"; exit 1; }
        as_root=(sudo)
    fi
    # Its option waits for dpkg's lock, but not for that of the package lists.
    while ! log=$("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive LC_ALL=C apt-get -qq -o DPkg::Lock::Timeout=600 "$@" 2>&1); do
        if [[ $log != *"ould not get lock"* || $waited -ge 600 ]]; then echo "$log" >&2; exit 1; fi
        [ $waited -gt 0 ] || say "another program is installing packages: waiting for it"
        sleep 5
        waited=$((waited + 5))
    done
}

install_packages() {
    local missing
    missing=$(comm -23 <(printf '%s\n' "${PACKAGES[@]}" | sort) \
        <(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "${PACKAGES[@]}" 2>/dev/null | sed -n 's/^installed //p' | sort))
    [ -n "$missing" ] || return 0
    say "installing packages (on a fresh system 1 GB and a few minutes; waits while another program installs): ${missing//$'\n'/ }"
    as_root_apt update
    # shellcheck disable=SC2086
    as_root_apt install -y --no-install-recommends $missing
}

# build PRESET ARGUMENTS of CMake [-- TARGETS]. Ninja configures anew by itself where files of CMake have changed.
build() {
    local folder=build/$1 start=$SECONDS configuration=()
    while [ $# -gt 0 ] && [ "$1" != -- ]; do configuration+=("$1"); shift; done
    if [ ! -e "$folder/build.ninja" ] || [ "$folder/CMakeCache.txt" -nt "$folder/arguments" ] ||
        [ "$(cat "$folder/arguments")" != "${configuration[*]}" ]; then
        mkdir -p "$folder"
        rm -f "$folder/arguments"
        cmake --preset "${configuration[@]}" >"$folder.log" 2>&1 || { cat "$folder.log" >&2; exit 1; }
        echo "${configuration[*]}" >"$folder/arguments"
        [ -e "$folder/.ninja_log" ] || say "building in $folder; once: about $((CPU_MINUTES / $(nproc) + 1)) minutes on $(nproc) cores"
    fi
    ninja -C "$folder" "${@:2}"
    [ $((SECONDS - start)) -lt 5 ] || say "built in $((SECONDS - start)) s"
}

# build_portable TARGET ARGUMENTS of CMake: in build/release for this machine, in build/portable for older processors.
build_portable() {
    PACKAGES+=(patchelf xz-utils)
    install_packages
    build release -DSIDEWALL_TESTS=OFF "${@:2}" -- sidewall sidewall_core ${1:+"$1"}
    build portable "${@:2}" -- sidewall_portable ${1:+"$1"}
    app/package/portable.sh "$command"
}

command=${1:-}
[ $# -gt 0 ] && shift
CPU_MINUTES=14
case "$command" in
    deps) install_packages ;;
    run)
        install_packages
        # A build with tests or the module has the program, too.
        read -ra configuration < <(cat build/release/arguments 2>/dev/null || echo release -DSIDEWALL_TESTS=OFF -DSIDEWALL_PYTHON=OFF)
        build "${configuration[@]}" -- sidewall >&2
        [ $# -gt 0 ] || set -- configs/trench_deposition.toml
        exec build/release/sidewall run "$@"
        ;;
    test)
        PACKAGES+=("${PYTHON_PACKAGES[@]}" python3-numpy python3-pytest libopenmpi-dev openmpi-bin)
        CPU_MINUTES=30
        install_packages
        # shellcheck disable=SC2086
        build release -DSIDEWALL_TESTS=ON "${PYTHON[@]}" ${SIDEWALL_CMAKE_ARGS:-}
        # shellcheck disable=SC2086
        ctest --preset release ${SIDEWALL_CTEST_ARGS:-}
        ;;
    package)
        PACKAGES+=("${PYTHON_PACKAGES[@]}" dpkg-dev file)
        install_packages
        build release -DSIDEWALL_TESTS=OFF "${PYTHON[@]}"
        rm -f build/package/*.deb
        cpack --config build/release/CPackConfig.cmake -B build/package
        rm -r build/package/_CPack_Packages
        ;;
    archive) build_portable "" -DSIDEWALL_PYTHON=OFF ;;
    wheel)
        PACKAGES+=("${PYTHON_PACKAGES[@]}" python3-wheel)
        build_portable sidewall_python "${PYTHON[@]}"
        ;;
    *)
        usage >&2
        exit 2
        ;;
esac
