#!/usr/bin/env bash
# By clang, with warnings as errors: builds the core alone, without PCL, and runs tests of
# it; then reads every source of the project, each by itself.
#
#   test/clang.sh [ctest options]         tests of what compilers differ in: NaN,
#                                         contraction, alignment, order of evaluation
#   test/clang.sh --all [ctest options]   all tests of the core
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=cmake/setup.sh
source "$root/cmake/setup.sh"

tests=(kernel point_batch local_points rotation fit_closed_form fit_degenerate
  fit_precision covariance_exact pattern simulator patch_map)
targets=(-- "${tests[@]/#/test_}")
chosen=(-R "^($(IFS="|" && echo "${tests[*]}"))\$")
if [[ ${1:-} == --all ]]; then
  targets=()
  chosen=(-E "^(format|include_direction|one_definition|headers_compile_alone|package_setup|readme|links|versions)")
  shift
fi

install_packages build test
build_in "$root/build-core" -DCMAKE_BUILD_TYPE=Release -DHOLDFAST_WITH_PCL=OFF \
  -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG" \
  -DHOLDFAST_WERROR=ON "${targets[@]}"
ctest --test-dir "$root/build-core" --output-on-failure --parallel 2 "${chosen[@]}" "$@"

"$root/test/support/check_clang.sh"
