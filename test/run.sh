#!/usr/bin/env bash
# Installs what is missing, builds everything and runs every test.
#
#   test/run.sh [ctest options]     e.g. test/run.sh -R rotation
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
exec ctest --test-dir "$root/build-test" --output-on-failure --parallel 2 "$@"
