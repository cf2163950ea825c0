#!/usr/bin/env bash
# bench/gpu/pack.sh [FOLDER=gpu-folder] [BUILD=build]: what run.sh needs, in one folder for an x86-64 Linux with a GPU's driver and
# nothing else (glibc of the release that this is built on, or newer). Nothing of it is a driver.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
folder=${1:-gpu-folder}
build=${2:-build}
programs=(raylign_gpu raylign_tests_gl raylign_tests_backends)
for program in "${programs[@]}"; do
    [ -x "$build/bin/$program" ] || { echo "$build/bin/$program is missing: ninja -C $build ${programs[*]}" >&2; exit 1; }
done
rm -rf "$folder"
mkdir -p "$folder"/{bin,lib,lib-where-missing}
for program in "${programs[@]}"; do
    cp "$build/bin/$program" "$folder/bin/"
    ldd "$build/bin/$program"
done | awk '$3 ~ /^\// {print $3}' | sort -u | while read -r library; do
    case $(basename "$library") in
        # The C library is the machine's own; the driver was made for it.
        ld-linux*|libc.so.*|libm.so.*|libdl.so.*|libpthread.so.*|librt.so.*|libresolv.so.*) ;;
        # An older one of these before a newer one would break the driver: only for a machine that has none.
        libstdc++.so.*|libgcc_s.so.*) cp -L "$library" "$folder/lib-where-missing/" ;;
        *) cp -L "$library" "$folder/lib/" ;;
    esac
done
# GLVND's libraries pass calls on to the driver; machines that only compute often lack them.
for library in libEGL.so.1 libGLdispatch.so.0 libOpenGL.so.0 libGL.so.1 libGLX.so.0; do
    file=$(ldconfig -p | awk -v name="$library" '$1 == name && /x86-64/ {print $NF; exit}')
    [ -z "$file" ] || cp -L "$file" "$folder/lib-where-missing/"
done
cp "$here/run.sh" "$folder/"
strip --strip-unneeded "$folder"/bin/* "$folder"/lib/* "$folder"/lib-where-missing/* 2>/dev/null || true
echo "$folder: $(du -sm "$folder" | cut -f1) MB. There: OUT=results $folder/run.sh"
