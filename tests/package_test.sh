#!/usr/bin/env bash
# package_test.sh [FOLDER]: installs the packages of build/package in a bare Debian 12, first the program and then the Python
# package, and runs recipes there as a user without privileges.
# Run by hand as root, with debootstrap installed, after ./setup.sh package. MIRROR names a mirror of Debian, ROOT an
# unpacked minbase root to begin with, else debootstrap fetches one; APT_OPTIONS are apt-get's in there.
set -euo pipefail
here=$(dirname "$(realpath "${BASH_SOURCE[0]}")")
packages=$(realpath "${1:-$here/../build/package}")
mirror=${MIRROR:-http://deb.debian.org/debian}

folder=$(mktemp -d)
root=$folder/root
cleanup() { mountpoint -q "$root/proc" && umount "$root/proc"; rm -rf "$folder"; }
trap cleanup EXIT
if [ -n "${ROOT:-}" ]; then cp -a "$ROOT" "$root"; else debootstrap --variant=minbase bookworm "$root" "$mirror"; fi
mount -t proc proc "$root/proc"
cp "$packages"/*.deb "$root/tmp/"
cp /etc/resolv.conf "$root/etc/resolv.conf"

within() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root DEBIAN_FRONTEND=noninteractive \
    http_proxy="${http_proxy:-}" https_proxy="${https_proxy:-}" "$@"; }
install() {
    local start=$SECONDS
    within bash -c "apt-get ${APT_OPTIONS:-} install -y -qq --no-install-recommends /tmp/$1_*.deb" >"$folder/log" 2>&1 ||
        { cat "$folder/log"; exit 1; }
    echo "package_test.sh: $1 installed in $((SECONDS - start)) s"
    [ $((SECONDS - start)) -lt 60 ]
}
within apt-get ${APT_OPTIONS:-} update -qq
install sidewall

within useradd --create-home --shell /bin/bash engineer
as_user() { within su - engineer -c "$1"; }
as_user 'sidewall --version'
as_user 'sidewall run /usr/share/sidewall/configs/quick/trench_deposition.toml --quiet'
as_user 'test -s results/trench_deposition/summary.json'
as_user 'sidewall run /usr/share/sidewall/configs/quick/gds_masked_etch.toml --quiet'
as_user 'sidewall render results/trench_deposition -o picture.png && test -s picture.png'
within test -s /usr/share/man/man1/sidewall.1
within bash -c '. /usr/share/bash-completion/completions/sidewall && complete -p sidewall' >/dev/null
install python3-sidewall
as_user "python3 -c 'import sidewall; print([step.time for step in sidewall.Simulation(\"/usr/share/sidewall/configs/quick/trench_deposition.toml\")][-1])'"
as_user 'python3 -m sidewall check --no-estimate /usr/share/sidewall/configs/quick/fin_deposition.toml >/dev/null'
within apt-get purge -y -qq sidewall python3-sidewall >"$folder/log" 2>&1
! within test -e /usr/share/sidewall
echo "package_test.sh: passed"
