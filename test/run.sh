#!/usr/bin/env bash
# Installs what is missing, builds everything and runs every test; then what else must
# hold: the quick start works, the core does without PCL, clang has nothing to say, and
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

install_packages build python test ros
leg "all tests"
# Sixteen sources at a time: most of what they take goes into the headers that they
# share. That each compiles by itself, clang shows below.
build_in "$root/build-test" -DCMAKE_BUILD_TYPE=Release -DHOLDFAST_WERROR=$werror \
  -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=16
ctest --test-dir "$root/build-test" --output-on-failure --parallel 2 "$@"
(($#)) && exit

leg "the quick start, without OpenNI2 and viewer"
"$root/samples/quickstart.sh" -o "$root/build-quickstart/results"

leg "the core alone, by clang, and every source read by it"
"$root/test/clang.sh"

leg "sanitizers, without Highway"
"$root/test/sanitize.sh"
leg "done"
