#!/usr/bin/env bash
# Fuzzes the readers and the fit with clang's libFuzzer, AddressSanitizer and
# UndefinedBehaviorSanitizer, one target after the other.
#
#   test/fuzz.sh MINUTES [target...]     all together MINUTES; e.g. 60 pcd ply
#
# Prints executions and coverage of each. An input that breaks a promise is stored among
# the seeds in test/fuzz/corpus/, so that the tests run it from then on; the exit code is
# then 1. What was learned stays in build-fuzz/ for the next time.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=cmake/setup.sh
source "$root/cmake/setup.sh"

if ! [[ ${1:-} =~ ^[1-9][0-9]*$ ]]; then
  echo "usage: test/fuzz.sh MINUTES [target...]" >&2
  exit 2
fi
minutes=$1
shift
targets=("$@")
((${#targets[@]})) || targets=(pcd ply depth_image oni sensor patches fit)
for what in "${targets[@]}"; do
  if [[ ! -e $root/test/fuzz/fuzz_$what.cpp ]]; then
    echo "test/fuzz.sh: $what is not a target" >&2
    exit 2
  fi
done

install_packages build test fuzz
folder=$root/build-fuzz
# Without Highway, whose vectors take sanitizers minutes to compile.
build_in "$folder" -DCMAKE_C_COMPILER=clang-14 -DCMAKE_CXX_COMPILER=clang++-14 \
  -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" \
  -DHOLDFAST_FUZZER=ON -DHOLDFAST_SANITIZE="fuzzer-no-link;address;undefined" \
  -DHOLDFAST_WITH_HIGHWAY=OFF -DHOLDFAST_BUILD_APPS=OFF -DHOLDFAST_BUILD_SAMPLES=OFF \
  -DHOLDFAST_BUILD_BENCHMARKS=OFF -- "${targets[@]/#/fuzz_}"

# PCL itself is not instrumented; see test/sanitize.sh.
export ASAN_OPTIONS=detect_container_overflow=0
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1

# fuzz WHAT SECONDS: starts again behind a finding, while there is time.
fuzz() {
  local what=$1 end=$((SECONDS + $2)) seeds=$root/test/fuzz/corpus/$1
  local learned=$folder/corpus/$what findings=$folder/findings/$what log
  local executions=0 coverage="" runs=0 found=()
  # Those of the last time are among the seeds.
  rm -rf "$findings" "$folder/fuzz_$what".*.log
  mkdir -p "$learned" "$findings"
  while ((end > SECONDS && runs++ < 20)); do
    log=$folder/fuzz_$what.$runs.log
    nice -n 15 "$folder/test/fuzz/fuzz_$what" "$learned" "$seeds" \
      -max_total_time=$((end - SECONDS)) -max_len=16384 -timeout=20 -rss_limit_mb=2048 \
      -print_final_stats=1 -artifact_prefix="$findings/" >"$log" 2>&1 && end=0
    executions=$((executions + $(awk '/stat::number_of_executed_units/ { n = $2 }
      END { print n + 0 }' "$log")))
    coverage=$(grep -o 'cov: [0-9]* ft: [0-9]*' "$log" | tail -1)
  done
  mapfile -t found < <(find "$findings" -type f ! -name 'slow-unit-*')
  printf '%-12s %12d executions  %-24s %d findings\n' \
    "$what" "$executions" "$coverage" "${#found[@]}"
  ((${#found[@]} == 0)) && return
  cp "${found[@]}" "$seeds/"
  grep -hE '^broken: |SUMMARY: |runtime error: ' "$folder/fuzz_$what".*.log |
    sort | uniq -c
  return 1
}

status=0
for what in "${targets[@]}"; do
  fuzz "$what" $((60 * minutes / ${#targets[@]})) || status=1
done
exit $status
