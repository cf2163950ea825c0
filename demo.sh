#!/usr/bin/env bash
# Sets up, builds, and registers a real head CT to two simulated X-rays. Run it again at will.
#   RAYLIGN_BUILD_ONLY=1 ./demo.sh   stops after the build
#   RAYLIGN_PHANTOM=1 ./demo.sh      uses the spine phantom instead of the CT
set -euo pipefail
cd "$(dirname "$0")"

packages=(g++ cmake ninja-build libeigen3-dev libnlopt-dev libtbb-dev libxsimd-dev libinsighttoolkit5-dev libgdcm-dev libhdf5-dev
          libtiff-dev libexpat1-dev libyaml-cpp-dev zlib1g-dev libssl-dev nlohmann-json3-dev libcli11-dev libgtest-dev libgmock-dev libbenchmark-dev
          libopenmpi-dev openmpi-bin libegl-dev libgl-dev libegl1 libegl-mesa0 libgl1-mesa-dri)
# Debian 13's ITK 5.4 names FFTW among its libraries, and its package only recommends it: without it linking ends at -lfftw3.
packages+=(libfftw3-dev)
read -ra extra <<<"${RAYLIGN_EXTRA_PACKAGES:-}"
packages+=("${extra[@]}")
ct_package=invesalius-examples   # a real head CT: wanted, not needed

installed() { dpkg-query -W -f='${Status}' "$1" 2>/dev/null | grep -q '^install ok installed'; }

install() {  # quietly; with the whole output when it fails
    local as_root=() log
    [ "$(id -u)" = 0 ] || as_root=(sudo)
    log=$(mktemp)
    if ! { "${as_root[@]}" apt-get update && "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
           apt-get install -y --no-install-recommends "$@"; } >"$log" 2>&1; then
        cat "$log" >&2
        rm -f "$log"
        return 1
    fi
    rm -f "$log"
}

missing=()
for package in "${packages[@]}"; do installed "$package" || missing+=("$package"); done
if [ ${#missing[@]} -gt 0 ]; then
    echo "== installing ${missing[*]}"
    install "${missing[@]}"
fi

echo "== building"
cmake --preset release >build.log 2>&1 || { cat build.log >&2; exit 1; }
cmake --build --preset release >>build.log 2>&1 || { tail -n 60 build.log >&2; exit 1; }
[ -z "${RAYLIGN_BUILD_ONLY:-}" ] || exit 0

out=demo_output
raylign=build/bin/raylign
mkdir -p $out
if [ -z "${RAYLIGN_PHANTOM:-}" ] && ! installed $ct_package && ! install $ct_package 2>/dev/null; then
    echo "== the package $ct_package cannot be had here: using the spine phantom instead of a real CT"
    RAYLIGN_PHANTOM=1
fi
if [ -n "${RAYLIGN_PHANTOM:-}" ]; then
    $raylign phantom spine --size 192,192,192 --spacing 1,1,1 -o $out/spine.mha
    ct=(-v $out/spine.mha --attenuation)
    echo "== CT: the spine phantom, 192 x 192 x 192 voxels"
else
    # The project file of another program: a tar with the raw voxels, rows stored back to front. The header says so.
    tar -xzf /usr/share/doc/$ct_package/examples/Cranium.inv3 -C $out --transform='s:.*/::' --wildcards '*/matrix.dat'
    cat >$out/head.mhd <<'MHD'
ObjectType = Image
NDims = 3
DimSize = 256 256 108
ElementType = MET_SHORT
ElementByteOrderMSB = False
ElementSpacing = 0.9570312 0.9570312 1.5
TransformMatrix = 1 0 0 0 -1 0 0 0 1
Offset = -122.0215 122.0215 -80.25
BinaryData = True
ElementDataFile = matrix.dat
MHD
    ct=(-v $out/head.mhd)
    echo "== CT: a real head, 256 x 256 x 108 voxels"
fi

# Two views at 90 degrees: patient axes LPS about the isocentre, 1000 mm from the source, detectors of 256 x 256 pixels.
cat >$out/geometry.json <<'JSON'
{ "raylign": 1,
  "views": [
    { "name": "AP",
      "c_arm": { "sad_mm": 1000, "sdd_mm": 1500, "primary_angle_deg": 0, "secondary_angle_deg": 0,
                 "pixel_pitch_mm": [1.55, 1.55], "size_px": [256, 256] } },
    { "name": "LAT",
      "c_arm": { "sad_mm": 1000, "sdd_mm": 1500, "primary_angle_deg": 90, "secondary_angle_deg": 0,
                 "pixel_pitch_mm": [1.55, 1.55], "size_px": [256, 256] } } ] }
JSON
# Where the patient really is (hidden from the registration) ...
cat >$out/hidden_pose.json <<'JSON'
{ "raylign": 1,
  "world_from_ct": [[0.99756405, -0.06958655,  0.00486597,  2.4],
                    [0.06975647,  0.99513403, -0.06958655, -3.3],
                    [0.00000000,  0.06975647,  0.99756405,  2.2],
                    [0, 0, 0, 1]] }
JSON
# ... and where it is believed to be: as the CT was taken.
cat >$out/start_pose.json <<'JSON'
{ "raylign": 1, "world_from_ct": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]] }
JSON

echo "== simulating two X-rays with photon noise at a hidden pose"
# Another projector with a finer step than the registration uses, so that the match is not exact by construction.
$raylign drr "${ct[@]}" --views $out/geometry.json --pose $out/hidden_pose.json --projector trilinear --step 0.3 \
    --noise 20000 --seed 1 -o $out/xrays
echo "== registering"
$raylign register "${ct[@]}" --views $out/xrays/views.json --start $out/start_pose.json --truth $out/hidden_pose.json \
    -o $out/result
echo
echo "Look at $out/result/overlay_AP.png and overlay_LAT.png: before and after."
