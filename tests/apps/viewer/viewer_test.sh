#!/usr/bin/env bash
# One part of the viewer's tests: viewer_test.sh PART RAYLIGN WORK SOURCE CHROMIUM NPM NODE. PART.mjs says what it checks.
set -euo pipefail
part=$1 raylign=$2 work=$3 source=$4 chromium=$5 npm=$6 node=$7

skip() {
    echo "skipped: $1"
    [ -z "${RAYLIGN_REQUIRE_BROWSER:-}" ] || exit 1
    exit 77
}
[ -x "$chromium" ] && [ -x "$npm" ] && [ -x "$node" ] || skip "chromium, npm or node is not installed"
rm -rf "$work/case" "$work/shots"
mkdir -p "$work/driver" "$work/case" "$work/shots"
cp "$source"/*.mjs "$source"/package.json "$source"/package-lock.json "$work/driver"
(cd "$work/driver" && "$npm" ci --ignore-scripts --no-audit --no-fund >npm.log 2>&1) || skip "npm cannot fetch puppeteer-core"
cd "$work/case"
exec "$node" ../driver/"$part".mjs "$chromium" "$raylign" ../shots "${RAYLIGN_TEST_DATA:-$source/../../../../shared/data}"
