#!/usr/bin/env bash
# Packages as people meet them: builds raylign_*.deb, libraylign-dev_*.deb, python3-raylign_*.deb and the folder, installs the
# first in a bare root of this release by apt, registers a phantom there from the shell and from Python, compiles the example of
# docs/library.md, removes all of it; then runs the folder in a bare root without installing anything. Needs root, debootstrap,
# Debian's mirror and 3 GB; where one is missing it says so and exits with 77, as skipped tests do.
#   package.sh debian       only Debian's packages; package.sh folder: only the folder
#   package.sh trixie       those of another release of Debian, built and tried in a root of it: DIR/trixie, which is kept
#   RAYLIGN_BUILD=DIR       builds there instead of in build-packages
#   RAYLIGN_BARE_ROOT=DIR   works there; DIR/bare.tar is the bare root, made where it is missing
set -euo pipefail
cd "$(dirname "$0")/../.."
. .ci/setup.sh
project=$PWD
build_folder=$(realpath -m "${RAYLIGN_BUILD:-build-packages}")
work=$(realpath -m "${RAYLIGN_BARE_ROOT:-$build_folder/bare}")
root=$work/root

skip() { echo "packages cannot be tried here: $1" >&2; exit 77; }
[ "$(id -u)" = 0 ] || skip "a bare root is made by root only"
grep -qx 'ID=debian' /etc/os-release || skip "they are tried in a bare Debian, and this is another system"
release=$(. /etc/os-release && echo "$VERSION_CODENAME")
mirror=${RAYLIGN_DEBIAN_MIRROR:-http://deb.debian.org/debian}
need_packages debootstrap patchelf dpkg-dev file man-db "${program_packages[@]}" python3-dev pybind11-dev python3-numpy ||
    skip "packages that it needs cannot be installed"

say() { echo "== $* (after $((SECONDS / 60)):$(printf %02d $((SECONDS % 60))) min)"; }
must() { "$@" || { echo "package.sh: failed: $*" >&2; exit 1; }; }
bytes() { numfmt --to=iec-i --suffix=B --format=%.1f "$(stat -c %s "$1")"; }
in_root() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive bash -c "$1"; }

# bare RELEASE ROOT: makes it of what every Debian has, or skips.
bare() {
    mkdir -p "$work"
    debootstrap --variant=minbase "$1" "$2" "$mirror" >"$work/debootstrap.log" 2>&1 || {
        tail -n 3 "$work/debootstrap.log" >&2
        rm -rf --one-file-system "$2"
        skip "debootstrap cannot make a root of $1 from $mirror"
    }
}

# A fresh bare root: made once, kept as a tar.
leave_root() { umount "$root/proc" 2>/dev/null || true; }
trap leave_root EXIT
fresh_root() {
    leave_root
    rm -rf --one-file-system "$root"
    if [ ! -f "$work/bare.tar" ]; then
        bare "$release" "$root"
        tar -C "$root" --one-file-system -cf "$work/bare.tar.part" . && mv "$work/bare.tar.part" "$work/bare.tar"
    else
        mkdir -p "$root" && tar -C "$root" -xpf "$work/bare.tar"
    fi
    mount -t proc proc "$root/proc"  # the program asks how much memory there is
    mkdir "$root/case"
    cp tests/package/case/* "$root/case/"
}

# The phantom's X-rays at a known pose, registered from a start 5 mm and 6 degrees away; $1: the program. Prints the error at the targets.
register_phantom() {
    in_root "cd /case && $1 phantom spine --size 96 --spacing 2,2,2 -o spine.mha &&
             $1 drr -v spine.mha --attenuation --views views.json --pose truth.json -o xrays --quiet &&
             $1 register -v spine.mha --attenuation --views xrays/views.json --start start.json --truth truth.json --backend cpu -o result --quiet &&
             grep -o '\"final_mtre_mm\": *[0-9.e+-]*' result/report.json" | tail -n 1
}
# Below 0.5 mm, or it ends here.
check_error() { awk -v text="$1" 'BEGIN { sub(/.*: */, "", text); print "   " text " mm from the truth"; exit !(text != "" && text + 0 < 0.5) }'; }

out=$build_folder/packages

# What the packages hold, looked at.
pack_debian() {
    say "building in $build_folder"
    configure "$build_folder" --preset packages -DRAYLIGN_BUILD_MPI=AUTO
    must build "$build_folder"
    rm -f "$out"/*.deb
    say "packing, under umask 077"
    (umask 077 && cd "$build_folder" && must cpack -G DEB -B "$out" >"$build_folder/cpack.log" 2>&1) || { cat "$build_folder/cpack.log" >&2; exit 1; }
    for package in "$out"/*.deb; do
        echo "   $(basename "$package") $(bytes "$package"): $(dpkg-deb -f "$package" Installed-Size) KiB, depends on $(dpkg-deb -f "$package" Depends)"
        if dpkg-deb -c "$package" | awk '{ print $1, $2 }' | grep -vE '^(d[rwx-]{3}r-xr-x|-rw-r--r--|-rwxr-xr-x|l[rwx-]+) root/root$'; then
            echo "package.sh: rights or owners as these must not be in $package" >&2
            exit 1
        fi
    done
    for page in "$build_folder"/manuals/man/*.1; do
        [ -z "$(LC_ALL=C.UTF-8 MANROFFSEQ='' MANWIDTH=80 man --warnings -E UTF-8 -l -Tutf8 "$page" 2>&1 >/dev/null)" ] ||
            { echo "package.sh: man warns of $page" >&2; exit 1; }
    done
    must bash -n "$build_folder/manuals/bash/raylign"
    if command -v zsh >/dev/null; then must zsh -n "$build_folder/manuals/zsh/_raylign"; fi
    if command -v fish >/dev/null; then must fish -n "$build_folder/manuals/fish/raylign.fish"; fi
}

# Installed, used, removed.
debian() {
    pack_debian
    say "a bare $release"
    fresh_root
    in_root 'dpkg-query -W -f="\${Package}\n" | sort' >"$work/before"
    mkdir "$root/debs" && cp "$out"/*.deb "$root/debs/"
    in_root 'apt-get update -q -o APT::Update::Error-Mode=any' >"$work/apt.log" 2>&1 || skip "apt finds no mirror"
    say "apt install raylign"
    must in_root 'apt-get install -y --no-install-recommends /debs/raylign_*.deb' >>"$work/apt.log" 2>&1
    in_root 'dpkg-query -W -f="\${Package}\n" | sort' | comm -13 "$work/before" - | wc -l | sed 's/$/ packages came, itself included/; s/^/   /'
    grep -E '^(Need to get|After this)' "$work/apt.log" | sed 's/^/   /'
    in_root 'raylign --version' | sed 's/^/   /'
    say "registering the phantom from the shell"
    check_error "$(register_phantom raylign)"
    say "apt install python3-raylign"
    must in_root 'apt-get install -y --no-install-recommends /debs/python3-raylign_*.deb' >>"$work/apt.log" 2>&1
    say "registering the phantom from Python"
    must in_root 'cd /case && python3 register.py'
    say "apt install libraylign-dev, g++, cmake, pkg-config"
    must in_root 'apt-get install -y --no-install-recommends /debs/libraylign-dev_*.deb g++ make cmake pkg-config' >>"$work/apt.log" 2>&1
    cp -r tests/install/example "$root/example"
    say "the examples by pkg-config"
    must in_root 'cd /example && g++ -std=c++20 -O1 files.cpp -o /tmp/files $(pkg-config --cflags --libs --static raylign-io) && cd /tmp && ./files >/dev/null'
    say "the examples by CMake"
    must in_root 'cmake -S /example -B /tmp/b >/dev/null && cmake --build /tmp/b --target register files >/dev/null && cd /tmp && /tmp/b/register >/dev/null && /tmp/b/files >/dev/null'
    say "apt purge"
    must in_root 'apt-get purge -y raylign libraylign-dev python3-raylign' >>"$work/apt.log" 2>&1
    left=$(in_root 'find / -xdev -name "*raylign*" -not -path "/debs/*" -not -path "/example/*" -not -path "/case/*" -not -path "/tmp/*"')
    [ -z "$left" ] || { echo "package.sh: purge leaves $left" >&2; exit 1; }
}

# Without MPI, which is nothing without an installation of its own.
folder() {
    say "packing the folder"
    rm -f "$out"/*.tar.gz
    configure "$build_folder" --preset packages -DRAYLIGN_BUILD_MPI=OFF
    must build "$build_folder"
    (cd "$build_folder" && cpack -G TGZ -B "$out") >"$build_folder/cpack.log" 2>&1 || { cat "$build_folder/cpack.log" >&2; exit 1; }
    fresh_root
    archive=$(echo "$out"/*.tar.gz)
    tar -C "$root" --no-same-owner -xzf "$archive"
    mv "$root/$(basename "$archive" .tar.gz)" "$root/any where"
    echo "   $(basename "$archive") $(bytes "$archive"), unpacked $(du -sh "$root/any where" | cut -f1)"
    grep -o 'glibc [0-9.]* or newer' "$root/any where/README.txt" | sed 's/^/   /'
    say "registering the phantom from the folder, nothing installed"
    check_error "$(register_phantom '"/any where/bin/raylign"')"
}

# Another release's packages can be built on that release only: there this script runs once more, with these sources.
elsewhere() {
    local there=$work/$1
    [ -d "$there" ] || { say "a root of $1, to build in"; bare "$1" "$there.part"; mv "$there.part" "$there"; }
    mkdir -p "$there/raylign" "$there/raylign-build"
    # In a mount namespace of its own, which ends with it.
    must unshare -m bash -c 'mount --bind "$1" "$0/raylign" && mount -t proc proc "$0/proc" && exec chroot "$0" /usr/bin/env -i \
        PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 RAYLIGN_BUILD=/raylign-build RAYLIGN_DEBIAN_MIRROR="$2" \
        bash /raylign/tests/package/package.sh debian' "$there" "$project" "$mirror"
}

[ $# -gt 0 ] || set -- debian folder
for part in "$@"; do
    case $part in
        debian | folder) "$part" ;;
        *) elsewhere "$part" ;;
    esac
done
leave_root
rm -rf --one-file-system "$root"
say "all is well"
