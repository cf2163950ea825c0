# What demo.sh, test.sh and .ci/* share: packages and building. Sourced, with the root of the project as the current folder.

# What the program needs. ITK's package of Debian 13 only recommends FFTW, and its libraries do not link without it.
program_packages=(g++ cmake ninja-build libeigen3-dev libnlopt-dev libtbb-dev libxsimd-dev libinsighttoolkit5-dev libfftw3-dev
                  libgdcm-dev libhdf5-dev libtiff-dev libpng-dev libjpeg-dev libexpat1-dev libassimp-dev libmeshoptimizer-dev libyaml-cpp-dev zlib1g-dev libssl-dev nlohmann-json3-dev
                  libcli11-dev libopenmpi-dev openmpi-bin libegl-dev libgl-dev libegl1 libegl-mesa0 libgl1-mesa-dri)
# And the tests: GoogleTest, Google Benchmark, a second compiler of shaders; report pages are bundled with their charts and opened in a real browser.
test_packages=(libgtest-dev libgmock-dev libbenchmark-dev glslang-tools python3 pkg-config
               python3-dev pybind11-dev python3-numpy python3-pytest python3-nibabel python3-matplotlib)
command -v npm >/dev/null || test_packages+=(npm)
# The browser that the tests open report pages with; fails where there is none.
browser() { command -v chromium || command -v chromium-browser || command -v google-chrome; }
has_no_chromium_package() { grep -qx 'ID=ubuntu' /etc/os-release 2>/dev/null; }  # a snap, which apt cannot install
browser >/dev/null || has_no_chromium_package || test_packages+=(chromium)

installed() { dpkg-query -W -f='${Status}' "$1" 2>/dev/null | grep -q '^install ok installed'; }

# Installs those that are missing, quietly; with the whole output when it fails.
need_packages() {
    local missing=() as_root=() log package
    for package in "$@"; do installed "$package" || missing+=("$package"); done
    [ ${#missing[@]} -gt 0 ] || return 0
    if [ "$(id -u)" != 0 ]; then
        if ! command -v sudo >/dev/null; then
            echo "These packages are missing, and only root can install them (there is no sudo here either):" >&2
            echo "    apt-get install --no-install-recommends ${missing[*]}" >&2
            return 1
        fi
        as_root=(sudo)
    fi
    echo "== installing ${#missing[@]} packages: ${missing[*]}"
    log=$(mktemp)
    if ! { "${as_root[@]}" apt-get update && "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
           apt-get install -y --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
        cat "$log" >&2
        rm -f "$log"
        return 1
    fi
    rm -f "$log"
}

# configure FOLDER [CMake arguments]
configure() {
    local folder=$1
    shift
    mkdir -p "$folder" 2>/dev/null || { echo "$folder cannot be made: give a folder you may write to as RAYLIGN_BUILD" >&2; return 1; }
    cmake -B "$folder" -G Ninja "$@" >"$folder/configure.log" 2>&1 || { cat "$folder/configure.log" >&2; return 1; }
}

# build FOLDER [targets]: a line that moves on a terminal, a line every half minute elsewhere; the output only when it fails.
build() {
    local folder=$1 log=$1/build.log last=0
    shift
    : >"$log"
    local failed=0
    NINJA_STATUS="@ %f %t " ninja -C "$folder" "$@" 2>&1 | while IFS= read -r line; do
        printf '%s\n' "$line" >>"$log"
        case $line in "@ "*) ;; *) continue ;; esac
        read -r _ done total _ <<<"$line"
        if [ -t 1 ]; then
            printf '\r   step %s of %s, %d:%02d min ' "$done" "$total" $((SECONDS / 60)) $((SECONDS % 60))
        elif [ $((SECONDS - last)) -ge 30 ]; then
            last=$SECONDS
            echo "   step $done of $total, $((SECONDS / 60)):$(printf %02d $((SECONDS % 60))) min"
        fi
    done || failed=1  # `||`, or errexit would end the script here without a word
    [ ! -t 1 ] || echo
    [ "$failed" = 0 ] || { grep -v '^@' "$log" | tail -n 80 >&2; echo "the build failed; all of it: $log" >&2; return 1; }
}
