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
cp "$source"/*.mjs "$work/driver"
# One puppeteer-core for all parts, which may run at once: Node.js looks for it in the folders above, too.
shared=$(dirname "$work")
exec 9>"$shared/npm.lock"
flock 9
if ! cmp -s "$source/package-lock.json" "$shared/installed-lock.json"; then
    cp "$source"/package.json "$source"/package-lock.json "$shared"
    (cd "$shared" && "$npm" ci --ignore-scripts --no-audit --no-fund >npm.log 2>&1) || skip "npm cannot fetch puppeteer-core"
    cp "$source/package-lock.json" "$shared/installed-lock.json"
fi
exec 9>&-
cd "$work/case"
exec "$node" ../driver/"$part".mjs "$chromium" "$raylign" ../shots "${RAYLIGN_TEST_DATA:-$source/../../../../shared/data}"
