# Of the tests that open pages: need_browser CHROMIUM NPM NODE FOLDER. They skip without chromium, npm or node, or fail where
# RAYLIGN_REQUIRE_BROWSER is set. One puppeteer-core for all of them, which may run at once: in FOLDER, above their own, where Node.js
# looks for it.
skip() {
    echo "skipped: $1"
    [ -z "${RAYLIGN_REQUIRE_BROWSER:-}" ] || exit 1
    exit 77
}
need_browser() {
    local chromium=$1 npm=$2 node=$3 folder=$4 source
    source=$(dirname "${BASH_SOURCE[0]}")
    [ -x "$chromium" ] && [ -x "$npm" ] && [ -x "$node" ] || skip "chromium, npm or node is not installed"
    mkdir -p "$folder"
    exec 9>"$folder/npm.lock"
    flock 9
    if ! cmp -s "$source/package-lock.json" "$folder/installed-lock.json"; then
        cp "$source"/package.json "$source"/package-lock.json "$folder"
        (cd "$folder" && "$npm" ci --ignore-scripts --no-audit --no-fund >npm.log 2>&1) || skip "npm cannot fetch puppeteer-core"
        cp "$source/package-lock.json" "$folder/installed-lock.json"
    fi
    exec 9>&-
}
