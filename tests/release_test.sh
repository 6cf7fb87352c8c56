#!/usr/bin/env bash
# release_test.sh RELEASE [sources|package|archive|wheel]: in a bare root of Debian's or Ubuntu's RELEASE (bookworm, trixie, noble),
# which has nothing but its package manager:
#   sources   ./setup.sh run and ./setup.sh test of what is committed, timed
#   package   what ./setup.sh package made is installed, used by a user without privileges, and removed without trace
#   archive   the same for ./setup.sh archive
#   wheel     the same for ./setup.sh wheel, in an empty virtual environment
# Run by hand as root, with debootstrap installed. ROOT: an unpacked minbase root to begin with, else debootstrap fetches
# one (Debian 12's needs help with Ubuntu's, by the keyring of Ubuntu's package ubuntu-keyring: debootstrap --variant=minbase
# --components=main,universe --keyring=ubuntu-archive-keyring.gpg noble ROOT http://archive.ubuntu.com/ubuntu
# /usr/share/debootstrap/scripts/gutsy). MIRROR: a mirror to fetch from. APT_OPTIONS are apt-get's in there. CCACHE_DIR is used, if it is
# set. KEEP=1 leaves the root below TMPDIR, to look at what failed.
set -euo pipefail
[ "${SIDEWALL_IN_NAMESPACE:-}" ] || SIDEWALL_IN_NAMESPACE=1 exec unshare --mount --propagation private "$0" "$@"
release=$1 what=${2:-sources}
source=$(realpath "$(dirname "${BASH_SOURCE[0]}")/..")
configs=/usr/share/sidewall/configs

folder=$(mktemp -d -p "${TMPDIR:-/var/tmp}")
root=$folder/root
cleanup() {
    for mounted in proc dev/pts dev/shm dev ccache; do ! mountpoint -q "$root/$mounted" || umount -l "$root/$mounted"; done
    if [ "${KEEP:-}" ]; then echo "kept: $root"; else rm -rf --one-file-system "$folder"; fi
}
trap cleanup EXIT
case $release in noble) mirror=http://archive.ubuntu.com/ubuntu ;; *) mirror=http://deb.debian.org/debian ;; esac
if [ -n "${ROOT:-}" ]; then
    cp -a "$ROOT" "$root"
else
    debootstrap --variant=minbase --components=main,universe "$release" "$root" "${MIRROR:-$mirror}" >"$folder/log" ||
        { cat "$folder/log"; exit 1; }
fi
mount -t proc proc "$root/proc"
mount --bind /dev "$root/dev"
mount --bind /dev/pts "$root/dev/pts"
mount -t tmpfs tmpfs "$root/dev/shm"
cp /etc/resolv.conf "$root/etc/resolv.conf"

say() { echo "release_test.sh: $release: $*"; }
within() {
    chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
        http_proxy="${http_proxy:-}" https_proxy="${https_proxy:-}" ${ccache:-} "$@"
}
as_user() { within su - engineer -c "$1"; }
timed() {
    local start=$SECONDS
    "${@:2}"
    say "$1: $((SECONDS - start)) s"
}
install() { within bash -c "apt-get ${APT_OPTIONS:-} install -y -qq --no-install-recommends $*" >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }; }

within apt-get ${APT_OPTIONS:-} update -qq
within useradd --create-home --shell /bin/bash engineer
home=$root/home/engineer
cp "$source"/build/package/* "$root/tmp/" 2>/dev/null || true

# Runs recipes and draws a picture as the user; `sidewall` is on the path.
uses_the_program() {
    as_user 'sidewall --version'
    as_user "sidewall run $configs/quick/trench_deposition.toml --quiet && test -s results/trench_deposition/summary.json"
    as_user "sidewall run $configs/quick/gds_masked_etch.toml --quiet"
    as_user 'sidewall render results/trench_deposition -o picture.png && test -s picture.png'
}

# The commands in the block that docs/installing.md has under a heading.
commands_under() {
    awk -v heading="## $1" '/^## / { here = $0 == heading } /^```/ { inside = !inside; next } here && inside' "$source/docs/installing.md"
}

# Checks that removal has left nothing.
is_gone() {
    rm -f "$root/usr/local/bin/sidewall"  # the test's own link
    local left
    left=$(find "$root" -xdev -name '*sidewall*' ! -path "$root/tmp/*")
    [ -z "$left" ] || { say "left behind: $left"; exit 1; }
}

case $what in
    sources)
        if [ -n "${CCACHE_DIR:-}" ]; then
            install ccache
            mkdir "$root/ccache"
            mount --bind "$CCACHE_DIR" "$root/ccache"
            ccache="CCACHE_DIR=/ccache CCACHE_SLOPPINESS=pch_defines,time_macros"
        fi
        mkdir -p "$root/sidewall"
        git -C "$source" archive HEAD | tar -xC "$root/sidewall"
        timed "./setup.sh run" within /sidewall/setup.sh run
        timed "./setup.sh run, again" within /sidewall/setup.sh run configs/quick/trench_deposition.toml --overwrite
        timed "./setup.sh test" within /sidewall/setup.sh test
        ;;
    package)
        timed "package installed" install '/tmp/sidewall_*.deb'
        uses_the_program
        within test -s /usr/share/man/man1/sidewall.1
        within bash -c '. /usr/share/bash-completion/completions/sidewall && complete -p sidewall' >/dev/null
        timed "Python package installed" install '/tmp/python3-sidewall_*.deb'
        as_user "python3 -c 'import sidewall; print([step.time for step in sidewall.Simulation(\"$configs/quick/trench_deposition.toml\")][-1])'"
        as_user "python3 -m sidewall check --no-estimate $configs/quick/fin_deposition.toml >/dev/null"
        within apt-get purge -y -qq sidewall python3-sidewall >"$folder/log" 2>&1
        is_gone
        ;;
    archive)
        install xz-utils
        as_user 'cp /tmp/sidewall-*.tar.xz .'
        as_user "set -e; $(commands_under "An archive that runs anywhere"); rm -r results"
        as_user 'rm sidewall-*.tar.xz && mv sidewall-*-linux-* sidewall'
        within ln -s /home/engineer/sidewall/bin/sidewall /usr/local/bin/sidewall
        configs='~/sidewall/share/sidewall/configs'
        uses_the_program
        as_user 'test -s sidewall/share/man/man1/sidewall.1 && test -s sidewall/share/doc/sidewall/docs/tutorial.md'
        as_user '! ldd sidewall/bin/sidewall | grep "not found"'
        as_user 'rm -r sidewall'
        is_gone
        ;;
    wheel)
        install python3-venv python3-numpy python3-scipy  # NumPy is all that the wheel asks for, SciPy an example
        wheel=$(within python3 -c 'import sys; print(f"cp{sys.version_info.major}{sys.version_info.minor}")')
        as_user "python3 -m venv --system-site-packages venv && cp /tmp/sidewall-*-$wheel-$wheel-*.whl ."
        as_user "set -e; . venv/bin/activate; $(commands_under "A wheel"); rm -r sidewall-*.whl results"
        within ln -s /home/engineer/venv/bin/sidewall /usr/local/bin/sidewall
        configs='~/venv/share/sidewall/configs'
        uses_the_program
        cp -r "$source/docs/examples" "$home/examples"
        as_user 'cp -r venv/share/sidewall/configs . && . venv/bin/activate &&
            for example in examples/*.py; do python "$example" >/dev/null || exit 1; done'
        as_user 'venv/bin/pip uninstall -q -y sidewall'
        is_gone
        ;;
esac
say "$what: passed"
