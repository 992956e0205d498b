#!/usr/bin/env bash
# Installs what is missing, builds everything and runs every test, those of bad data and
# misuse once more under AddressSanitizer and UndefinedBehaviorSanitizer.
#
#   test/run.sh [ctest options]     e.g. test/run.sh -R rotation, without sanitizers
#
# With CI=true warnings are errors.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=cmake/setup.sh
source "$root/cmake/setup.sh"

werror=OFF
[[ ${CI:-} == true ]] && werror=ON

install_packages build test
build_in "$root/build-test" -DCMAKE_BUILD_TYPE=Release -DHOLDFAST_WERROR=$werror
ctest --test-dir "$root/build-test" --output-on-failure --parallel 2 "$@"
(($#)) && exit

"$root/test/sanitize.sh"
