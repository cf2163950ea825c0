#!/usr/bin/env bash
# One part of the viewer's tests: viewer_test.sh PART RAYLIGN WORK SOURCE CHROMIUM NPM NODE. PART.mjs says what it checks.
set -euo pipefail
part=$1 raylign=$2 work=$3 source=$4 chromium=$5 npm=$6 node=$7

. "$source/../browser/packages.sh"
need_browser "$chromium" "$npm" "$node" "$(dirname "$(dirname "$work")")"
rm -rf "$work/case" "$work/shots"
mkdir -p "$work/driver" "$work/case" "$work/shots"
cp "$source"/*.mjs "$work/driver"
cd "$work/case"
exec "$node" ../driver/"$part".mjs "$chromium" "$raylign" ../shots "${RAYLIGN_TEST_DATA:-$source/../../../../shared/data}"
