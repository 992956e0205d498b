#!/usr/bin/env bash
# Installs what is missing, builds everything and runs every test; then what else must
# hold: clang finds nothing to warn of, the core stands alone, the quick start works, and
# the tests of bad data and misuse pass under sanitizers.
#
#   test/run.sh [ctest options]     e.g. test/run.sh -R rotation: these tests alone
#
# With CI=true warnings are errors.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=cmake/setup.sh
source "$root/cmake/setup.sh"

werror=OFF
[[ ${CI:-} == true ]] && werror=ON

# What took how long, for whoever has to make it shorter.
leg() {
  printf '\n==== %s (after %d s)\n' "$1" "$SECONDS"
}

install_packages build test
leg "all tests"
build_in "$root/build-test" -DCMAKE_BUILD_TYPE=Release -DHOLDFAST_WERROR=$werror
ctest --test-dir "$root/build-test" --output-on-failure --parallel 2 "$@"
(($#)) && exit

leg "the core without PCL, by clang"
build_in "$root/build-core" -DCMAKE_BUILD_TYPE=Release -DHOLDFAST_WITH_PCL=OFF \
  -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG" \
  -DHOLDFAST_WERROR=ON
ctest --test-dir "$root/build-core" --output-on-failure --parallel 2 \
  -E "^(format|include_direction|headers_compile_alone|package_setup|readme_snippet)"

leg "everything else, by clang"
"$root/test/support/check_clang.sh"

leg "the quick start, without OpenNI2 and viewer"
"$root/samples/quickstart.sh" -o "$root/build-quickstart/results"

leg "sanitizers, without Highway"
"$root/test/sanitize.sh"
leg "done"
