#!/usr/bin/env bash
# Builds tests with sanitizers and runs them.
#
#   test/sanitize.sh [ctest options]            bad data, faults and live cameras, with
#                                               AddressSanitizer and
#                                               UndefinedBehaviorSanitizer
#   test/sanitize.sh --all [ctest options]      all tests, likewise
#   test/sanitize.sh --thread [ctest options]   extraction and live, with ThreadSanitizer
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=cmake/setup.sh
source "$root/cmake/setup.sh"

folder=$root/build-sanitize
sanitizers="address;undefined"
programs=OFF
tests=(fit_degenerate pcl_misuse point_types openni2_grabber cloud_io patch_io
  atomic_file config locale patch_extraction
  depth_images cloud_dialects trajectory_file foot_file patch_map contact_risk risk_grid
  point_selection)
case ${1:-} in
--all)
  folder=$root/build-sanitize-all
  programs=ON
  tests=()
  shift
  ;;
--thread)
  folder=$root/build-sanitize-thread
  sanitizers=thread
  tests=(patch_extraction frame_extraction monte_carlo consistency openni2_grabber
    thread_memory)
  shift
  ;;
esac

targets=()
chosen=(-E "^(format|include_direction|one_definition|headers_compile_alone|package_setup|readme|links|versions)")
if ((${#tests[@]})); then
  targets=(-- "${tests[@]/#/test_}")
  chosen=(-R "^($(IFS="|" && echo "${tests[*]}"))\$")
fi

install_packages build test
# Without Highway, whose vectors take sanitizers minutes to compile. Little optimisation
# and line numbers alone: what is looked for is found with them, and it compiles sooner.
build_in "$folder" -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1 -DNDEBUG" \
  -DHOLDFAST_SANITIZE="$sanitizers" -DHOLDFAST_WITH_HIGHWAY=OFF \
  -DHOLDFAST_BUILD_APPS=$programs -DHOLDFAST_BUILD_SAMPLES=$programs \
  -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=16 \
  -DHOLDFAST_BUILD_BENCHMARKS=OFF "${targets[@]}"

# PCL itself is not instrumented, so containers that it fills and we read (or the other
# way round) are annotated on one side only.
export ASAN_OPTIONS=detect_container_overflow=0
export LSAN_OPTIONS="suppressions=$root/test/support/leaks.txt:print_suppressions=0"
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
export TSAN_OPTIONS="halt_on_error=1:suppressions=$root/test/support/races.txt"
exec ctest --test-dir "$folder" --output-on-failure --parallel 2 "${chosen[@]}" "$@"
