#!/usr/bin/env bash
# portable.sh archive|wheel: packs what ./setup.sh has built into build/package, with all libraries that a bare system lacks.
# Sidewall's own code is in twice: the loader takes it from glibc-hwcaps/x86-64-v3 where the processor has AVX2.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
what=$1
version=$(sed -n 's/^project(sidewall VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
machine=$(uname -m)
stage=build/package/$what
rm -rf "$stage"
mkdir -p "$stage"

if [ "$what" = archive ]; then
    top=$stage/sidewall-$version-linux-$machine
    program=$top/bin/sidewall libraries=$top/lib/sidewall licences=$top/share/doc/sidewall/licences
    to_libraries='$ORIGIN/../lib/sidewall'
    of_system='libc|libm|libdl|librt|libpthread|ld-linux[^/]*'
else
    python=$(/usr/bin/python3 -c 'import sys; print(f"{sys.version_info.major}.{sys.version_info.minor}")')
    top=$stage data=$stage/sidewall-$version.data licences=$stage/sidewall-$version.dist-info/licences
    program=$data/scripts/sidewall libraries=$stage/sidewall.libs
    # From bin, as pip installs into virtual environments and for users, on Debian for all, and on Fedora.
    to_libraries="\$ORIGIN/../lib/python$python/site-packages/sidewall.libs"
    to_libraries+=":\$ORIGIN/../lib/python$python/dist-packages/sidewall.libs:\$ORIGIN/../lib64/python$python/site-packages/sidewall.libs"
    of_system='libc|libm|libdl|librt|libpthread|ld-linux[^/]*|libstdc\+\+|libgcc_s'  # a Python process has one of each
fi
mkdir -p "$(dirname "$program")" "$libraries" "$licences"
cmake --install build/release --component program --prefix "$stage/installed" >/dev/null
cp build/portable/portable/sidewall "$program"

# own FILE NAME: the library that a build makes as FILE, made in both.
own() {
    cp "build/portable/$1" "$libraries/$2"
    [ "$machine" != x86_64 ] || install -D "build/release/$1" "$libraries/glibc-hwcaps/x86-64-v3/$2"
}
own portable/libsidewall_core.so libsidewall_core.so
if [ "$what" = wheel ]; then
    cp -r build/portable/python/sidewall "$stage"
    module=$(basename "$stage"/sidewall/_sidewall*.so)
    own "python/sidewall/$module" libsidewall_python.so
    find "$libraries" -name libsidewall_python.so -exec patchelf --set-soname libsidewall_python.so {} \;
    # The module itself is empty: Python finds its function in the library that it needs.
    g++ -shared -o "$stage/sidewall/$module" -Wl,--no-as-needed -L"$libraries" -l:libsidewall_python.so
    patchelf --force-rpath --set-rpath '$ORIGIN/../sidewall.libs' "$stage/sidewall/$module"
fi
find "$stage" -name 'libsidewall_*.so' -exec strip --strip-unneeded {} +

# Libraries of others, under names that no other package in a process has; TBB looks for its allocator by name.
allocator=$(ldconfig -p | awk '/libtbbmalloc.so.2 / && !found++ {print $NF}')
renamed=()
for file in $(ldd "$program" "$libraries"/*.so | awk '$2 == "=>" {print $3}' | grep -vE "/($of_system|libsidewall_core)\.so" | sort -u); do
    name=$(basename "$file")
    cp -L "$file" "$libraries/sidewall-$name"
    patchelf --set-soname "sidewall-$name" "$libraries/sidewall-$name"
    renamed+=(--replace-needed "$name" "sidewall-$name")
    package=$(dpkg-query -S "*/$(basename "$(realpath "$file")")" | awk -F: '!found++ {print $1}')
    cp -L "/usr/share/doc/$package/copyright" "$licences/$package"
done
cp -L "$allocator" "$libraries"
for file in "$libraries"/*.so* "$libraries"/glibc-hwcaps/*/*.so; do
    to=\$ORIGIN
    [[ $file != */glibc-hwcaps/* ]] || to+=/../..
    [ -e "$file" ] || continue
    patchelf "${renamed[@]}" "$file"
    patchelf --force-rpath --set-rpath "$to" "$file"
done
patchelf "${renamed[@]}" "$program"
patchelf --force-rpath --set-rpath "$to_libraries" "$program"
strip "$program"

if [ "$what" = archive ]; then
    rm "$stage/installed/bin/sidewall"
    cp -r "$stage/installed/." "$top"
    made=build/package/$(basename "$top").tar.xz
    XZ_OPT=-T0 tar -C "$stage" --owner=0 --group=0 --sort=name -cJf "$made" "$(basename "$top")"
else
    mkdir -p "$data/data/share"
    cp -r "$stage"/installed/share/{sidewall,man} "$data/data/share"
    cp LICENSE "$data/data/share/sidewall"  # pip leaves folders without a file of their own behind
    cp LICENSE "$licences/sidewall"
    rm -r "$stage/installed"
    tag=cp${python/./}
    info=$stage/sidewall-$version.dist-info
    printf '%s\n' "Metadata-Version: 2.1" "Name: sidewall" "Version: $version" \
        "Summary: Level-set topography simulation with feature-aware mesh simplification" "License: GPL-3.0-or-later" \
        "Requires-Python: ==$python.*" "Requires-Dist: numpy" >"$info/METADATA"
    printf '%s\n' "Wheel-Version: 1.0" "Generator: portable.sh" "Root-Is-Purelib: false" \
        "Tag: $tag-$tag-manylinux_$(getconf GNU_LIBC_VERSION | sed 's/.* //; s/\./_/')_$machine" >"$info/WHEEL"
    /usr/bin/python3 -m wheel pack "$stage" -d build/package >/dev/null
    made=$(echo build/package/sidewall-"$version-$tag-$tag"-*.whl)
fi
rm -rf "$stage"
echo "$made: $(du -m "$made" | cut -f1) MB" >&2
