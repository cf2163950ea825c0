#!/usr/bin/env bash
# run.sh [first|second ...]: what a GPU is wanted for, in order of value, each step with its own limit; a step that fails or takes too
# long does not stop the next one. Results: $OUT (default ./results), a text and a JSON a step. In a folder made by pack.sh, or in the
# sources after a build. VOXELS and PIXELS (default 256) make a rehearsal on software OpenGL short.
set -uo pipefail
here=$(cd "$(dirname "$0")" && pwd)
bin=$here/bin
[ -d "$bin" ] || bin=${BUILD:-$here/../../build}/bin
OUT=${OUT:-results}
VOXELS=${VOXELS:-256} PIXELS=${PIXELS:-256}
mkdir -p "$OUT"

known_libraries=$(ldconfig -p 2>/dev/null)
machine_has() { grep -q "$1 .*x86-64" <<<"$known_libraries"; }
libraries=$here/lib
missing=
for library in libstdc++.so.6 libEGL.so.1 libGLdispatch.so.0; do machine_has "$library" || missing+=" $library"; done
if [ -n "$missing" ] && [ -d "$here/lib-where-missing" ]; then
    echo "taken along:$missing"
    mkdir -p "$OUT/libraries"
    case $missing in *libstdc++*) cp "$here"/lib-where-missing/lib{stdc++,gcc_s}.so.* "$OUT/libraries/" ;; esac
    case $missing in *EGL*|*GLdispatch*) cp "$here"/lib-where-missing/lib{EGL,GLdispatch,OpenGL,GL,GLX}.so.* "$OUT/libraries/" 2>/dev/null ;; esac
    libraries=$libraries:$(cd "$OUT/libraries" && pwd)
fi
for folder in /usr/local/nvidia/lib64 /usr/local/nvidia/lib; do [ ! -d "$folder" ] || libraries=$libraries:$folder; done
export LD_LIBRARY_PATH=$libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
# A container's driver often comes without the file that tells GLVND of it.
if ! ls /usr/share/glvnd/egl_vendor.d/*nvidia* /etc/glvnd/egl_vendor.d/*nvidia* >/dev/null 2>&1 &&
   { machine_has libEGL_nvidia.so.0 || ls /usr/local/nvidia/lib*/libEGL_nvidia.so.0 >/dev/null 2>&1; }; then
    echo '{"file_format_version": "1.0.0", "ICD": {"library_path": "libEGL_nvidia.so.0"}}' >"$OUT/nvidia.json"
    __EGL_VENDOR_LIBRARY_FILENAMES=$(cd "$OUT" && pwd)/nvidia.json
    export __EGL_VENDOR_LIBRARY_FILENAMES
fi
RAYLIGN_PROGRAM_FOLDER=$(cd "$OUT" && pwd)/programs
export RAYLIGN_PROGRAM_FOLDER RAYLIGN_REQUIRE_BACKENDS=reference,cpu,gl,gl-2006

# step LIMIT_S NAME PROGRAM ARGUMENTS...
failed=0
step() {
    local limit=$1 name=$2 start=$SECONDS
    shift 2
    timeout -k 5 "$limit" "$@" >"$OUT/$name.txt" 2>&1
    local rc=$?
    [ $rc = 0 ] || failed=$((failed + 1))
    printf '== %-20s exit code %3d, %4d s\n' "$name" $rc $((SECONDS - start))
    tail -n "${LINES_SHOWN:-4}" "$OUT/$name.txt" | cut -c1-180
}
measured() { local name=$2; step "$1" "$name" "$bin/raylign_gpu" "${@:3}" --json "$OUT/$name.json"; }

first() {  # does it run, is it right, what does it cost
    step 30 info "$bin/raylign_gpu" info
    ! command -v nvidia-smi >/dev/null || step 20 nvidia_smi nvidia-smi
    LINES_SHOWN=20 step 150 tests_gl "$bin/raylign_tests_gl" --gtest_brief=1
    LINES_SHOWN=2 measured 120 device device "$VOXELS" "$PIXELS"
    LINES_SHOWN=25 measured 60 calls calls "$VOXELS" "$PIXELS"
    LINES_SHOWN=20 measured 90 throughput_gl throughput "$VOXELS" "$PIXELS" gl
}
second() {  # where the ceilings are, other sizes, the paper's way
    LINES_SHOWN=12 measured 90 ceiling ceiling "$VOXELS" "$PIXELS"
    LINES_SHOWN=20 measured 60 throughput_small throughput $((VOXELS / 4)) $((PIXELS / 4)) gl
    LINES_SHOWN=20 measured 90 throughput_wide throughput "$VOXELS" $((2 * PIXELS)) gl
    LINES_SHOWN=10 measured 60 throughput_gl-2006 throughput "$VOXELS" "$PIXELS" gl-2006
    LINES_SHOWN=20 measured 60 throughput_cpu throughput "$VOXELS" "$PIXELS" cpu
    LINES_SHOWN=20 step 200 tests_backends "$bin/raylign_tests_backends" --gtest_brief=1 --gtest_filter='*gl*:*Gl*'
}
[ $# -gt 0 ] || set -- first second
for part in "$@"; do
    case $part in
        first|second) "$part" ;;
        *) echo "run.sh: $part: first or second" >&2; exit 2 ;;
    esac
done
echo "$failed steps failed; results in $OUT"
[ $failed = 0 ]
