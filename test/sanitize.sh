#!/usr/bin/env bash
# Builds the tests of misuse, degenerate data, point types and live cameras with
# AddressSanitizer and UndefinedBehaviorSanitizer and runs them.
#
#   test/sanitize.sh [ctest options]
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=cmake/setup.sh
source "$root/cmake/setup.sh"

install_packages build test
sanitized=(fit_degenerate pcl_misuse point_types openni2_grabber)
# Without Highway, whose vectors take sanitizers minutes to compile.
build_in "$root/build-sanitize" -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  -DHOLDFAST_SANITIZE="address;undefined" -DHOLDFAST_WITH_HIGHWAY=OFF \
  -DHOLDFAST_BUILD_APPS=OFF -DHOLDFAST_BUILD_SAMPLES=OFF \
  -DHOLDFAST_BUILD_BENCHMARKS=OFF -- "${sanitized[@]/#/test_}"

# PCL itself is not instrumented, so containers that it fills and we read (or the other
# way round) are annotated on one side only.
export ASAN_OPTIONS=detect_container_overflow=0
export LSAN_OPTIONS="suppressions=$root/test/support/leaks.txt:print_suppressions=0"
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
exec ctest --test-dir "$root/build-sanitize" --output-on-failure --parallel 2 \
  -R "^($(IFS="|" && echo "${sanitized[*]}"))\$" "$@"
