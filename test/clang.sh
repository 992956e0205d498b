#!/usr/bin/env bash
# By clang, with warnings as errors: builds the core alone, without PCL, and runs its
# tests; then checks the syntax of everything else.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=cmake/setup.sh
source "$root/cmake/setup.sh"

install_packages build test
build_in "$root/build-core" -DCMAKE_BUILD_TYPE=Release -DHOLDFAST_WITH_PCL=OFF \
  -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG" \
  -DHOLDFAST_WERROR=ON
ctest --test-dir "$root/build-core" --output-on-failure --parallel 2 \
  -E "^(format|include_direction|one_definition|headers_compile_alone|package_setup|readme|links|versions)"

"$root/test/support/check_clang.sh"
