#!/usr/bin/env bash
# Makes one page of each kind from a small phantom and opens them: pages_test.sh RAYLIGN WORK SOURCE CHROMIUM NPM NODE.
set -euo pipefail
raylign=$1 work=$2 source=$3 chromium=$4 npm=$5 node=$6

. "$source/../browser/packages.sh"
need_browser "$chromium" "$npm" "$node" "$(dirname "$work")"
mkdir -p "$work/driver"
cp "$source/open_report.mjs" "$work/driver"

cd "$work"
rm -rf pages shots
mkdir pages
"$raylign" phantom spine --size 48 --spacing 4 -o pages/spine.mha >/dev/null
cat >pages/geometry.json <<'JSON'
{ "raylign": 1, "views": [
  { "name": "AP", "c_arm": { "sad_mm": 1000, "sdd_mm": 1500, "primary_angle_deg": 0, "secondary_angle_deg": 0, "pixel_pitch_mm": [6.2, 6.2], "size_px": [64, 64] } },
  { "name": "LAT", "c_arm": { "sad_mm": 1000, "sdd_mm": 1500, "primary_angle_deg": 90, "secondary_angle_deg": 0, "pixel_pitch_mm": [6.2, 6.2], "size_px": [64, 64] } } ] }
JSON
cat >pages/truth.json <<'JSON'
{ "raylign": 1, "world_from_ct": [[0.99862953, -0.05233596, 0, 3], [0.05233596, 0.99862953, 0, -4], [0, 0, 1, 2.5], [0, 0, 0, 1]] }
JSON
ct=(-v pages/spine.mha --attenuation)
# A name that would end the script of the page, were it not made harmless.
mkdir -p 'pages/<script>alert(1)<'
cp pages/truth.json 'pages/<script>alert(1)</script>.json'
"$raylign" drr "${ct[@]}" --views pages/geometry.json --pose pages/truth.json --noise 20000 -o pages/xrays --quiet
"$raylign" register "${ct[@]}" --views pages/xrays/views.json --truth 'pages/<script>alert(1)</script>.json' -o pages/register --quiet || [ $? = 1 ]
"$raylign" study "${ct[@]}" --views pages/geometry.json --truth pages/truth.json --noise 20000 --bins 0:20:80 --per-bin 3 \
    --view AP --view AP,LAT -o pages/study --quiet
"$raylign" compare "${ct[@]}" --views pages/geometry.json --pose pages/truth.json --backends reference,cpu --poses 3 \
    --registrations 1 --longest-side 32 -o pages/compare --quiet
"$raylign" bench --size 32 --pixels 48 --repeat 1 -o pages/bench --quiet || [ $? = 1 ]
# Two frames, and a third without its second view: a flagged gap.
for frame in 1 2; do cp pages/xrays/drr_AP.tif pages/AP.$frame.tif; cp pages/xrays/drr_LAT.tif pages/LAT.$frame.tif; done
cp pages/xrays/drr_AP.tif pages/AP.3.tif
"$raylign" track --attenuation --bone upper=pages/spine.mha --bone lower=pages/spine.mha --joint upper,lower --views pages/geometry.json \
    --frames AP=pages/AP.%d.tif --frames LAT=pages/LAT.%d.tif --start pages/truth.json -o pages/track --quiet || [ $? = 1 ]
cp pages/register/report.html pages/register/register.html
"$node" driver/open_report.mjs "$chromium" shots pages/register/register.html pages/study/study.html pages/compare/compare.html pages/bench/bench.html pages/track/track.html
