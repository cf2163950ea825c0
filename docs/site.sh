#!/usr/bin/env bash
# Builds the manual as a site: build-site/html/index.html, which opens without a server and without a network.
#   RAYLIGN=PATH docs/site.sh   the program that makes its pictures and its page of commands; default build/bin/raylign, or the one in PATH
set -euo pipefail
cd "$(dirname "$0")/.."
. .ci/setup.sh
export PYTHONDONTWRITEBYTECODE=1
need_packages mkdocs doxygen

program=${RAYLIGN:-build/bin/raylign}
[ -x "$program" ] || program=$(command -v raylign || true)
[ -n "$program" ] || echo "== the program is not built (./demo.sh builds it): no pictures, no page of commands"
/usr/bin/python3 docs/site/assemble.py build-site/pages ${program:+"$program"}
# The C++ headers. What Doxygen warns of is an error, as in the rest of the manual.
(cat docs/site/Doxyfile && echo "OUTPUT_DIRECTORY = build-site/pages") | doxygen - 2>build-site/doxygen.log || { cat build-site/doxygen.log >&2; exit 1; }
[ ! -s build-site/doxygen.log ] || { cat build-site/doxygen.log >&2; exit 1; }
mkdir -p build-site/pages/js
cp docs/site/site.css build-site/pages/
cp docs/site/theme_extra.js build-site/pages/js/
/usr/bin/mkdocs build --quiet --strict --clean --config-file docs/site/mkdocs.yml
# Debian 12's theme asks for jQuery by another name than it installs.
[ -e build-site/html/js/jquery-3.6.0.min.js ] || cp build-site/html/js/jquery-*.min.js build-site/html/js/jquery-3.6.0.min.js
/usr/bin/python3 docs/site/check.py build-site/html
echo "== the manual: $PWD/build-site/html/index.html"
