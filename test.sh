#!/usr/bin/env bash
# Sets up, builds and runs all tests. Real data is taken from ../shared/data or $RAYLIGN_TEST_DATA; where it is there, a test
# that would skip for want of data or of a backend fails instead.
set -euo pipefail
cd "$(dirname "$0")"

# The report pages are bundled with their charts and opened in a real browser.
extra=()
command -v npm >/dev/null || extra+=(npm)
command -v chromium >/dev/null || extra+=(chromium)
RAYLIGN_EXTRA_PACKAGES="${extra[*]}" RAYLIGN_BUILD_ONLY=1 ./demo.sh
if [ -d "${RAYLIGN_TEST_DATA:-../shared/data}" ]; then export RAYLIGN_REQUIRE_DATA=1; fi
export RAYLIGN_REQUIRE_BACKENDS=reference,cpu,gl,gl-2006  # Mesa's software OpenGL, which demo.sh installs, will do
export RAYLIGN_REQUIRE_BROWSER=1
ctest --test-dir build --output-on-failure --no-tests=error -j "$(nproc)"
