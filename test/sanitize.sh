#!/usr/bin/env bash
# Builds the tests of misuse, degenerate data and point types with AddressSanitizer and
# UndefinedBehaviorSanitizer and runs them.
#
#   test/sanitize.sh [ctest options]
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=cmake/setup.sh
source "$root/cmake/setup.sh"

install_packages build test
targets=(test_pcl_misuse test_fit_degenerate test_point_types)
# Without optimisation the compiler's own time is most of it; -O1 keeps both short.
build_in "$root/build-sanitize" -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS=-O1 \
  "-DHOLDFAST_SANITIZE=address;undefined" -DHOLDFAST_BUILD_APPS=OFF \
  -DHOLDFAST_BUILD_SAMPLES=OFF -DHOLDFAST_BUILD_BENCHMARKS=OFF -- "${targets[@]}"

# PCL itself is not instrumented, so containers that it fills and we read (or the other
# way round) are annotated on one side only.
export ASAN_OPTIONS=detect_container_overflow=0:detect_stack_use_after_return=1
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
pattern=$(IFS='|' && echo "${targets[*]#test_}")
exec ctest --test-dir "$root/build-sanitize" --output-on-failure --parallel 2 \
  -R "^($pattern)\$" "$@"
