#!/usr/bin/env bash
# Sets up, builds and runs all tests. Real data is taken from ../shared/data or $RAYLIGN_TEST_DATA; where it is there, a test
# that would skip for want of data or of a backend fails instead. Arguments go to CTest: ./test.sh -L unit
set -euo pipefail
cd "$(dirname "$0")"
. .ci/setup.sh
build_folder=${RAYLIGN_BUILD:-build}

need_packages "${program_packages[@]}" "${test_packages[@]}"
echo "== building program, tests and benchmarks in $build_folder (10 minutes of two cores the first time)"
SECONDS=0
# The system's Python: the packages that its tests import are the system's, too.
configure "$build_folder" --preset release -DRAYLIGN_BUILD_TESTS=ON -DRAYLIGN_BUILD_BENCH=ON -DRAYLIGN_BUILD_PYTHON=ON \
    -DPython3_EXECUTABLE=/usr/bin/python3
build "$build_folder"
if [ -d "${RAYLIGN_TEST_DATA:-../shared/data}" ]; then export RAYLIGN_REQUIRE_DATA=1; fi
export RAYLIGN_REQUIRE_BACKENDS=reference,cpu,gl,gl-2006  # Mesa's software OpenGL, which setup.sh installs, will do
if browser >/dev/null; then
    export RAYLIGN_REQUIRE_BROWSER=1
else
    echo "== no browser here, so report pages are not opened in one: Ubuntu has chromium only as a snap (snap install chromium);"
    echo "   google-chrome will do, too. Configure again afterwards: rm $build_folder/CMakeCache.txt"
fi
ctest --test-dir "$build_folder" --output-on-failure --no-tests=error -j "$(nproc)" "$@"
