#!/usr/bin/env bash
# Every source, each by itself, read by clang with warnings as errors. No code is
# generated: that takes half of the time and finds nothing more.
#
#   check_clang.sh [FOLDER]     FOLDER to configure in (build-clang)
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
folder=${1:-$root/build-clang}

cmake -S "$root" -B "$folder" -G Ninja -DCMAKE_CXX_COMPILER=clang++ \
  -DCMAKE_BUILD_TYPE=Release -DHOLDFAST_WERROR=ON -DHOLDFAST_PRECOMPILE_HEADERS=ON \
  -DHOLDFAST_BUILD_BENCHMARKS=OFF -DCMAKE_EXPORT_COMPILE_COMMANDS=ON >/dev/null
# What sources include that the build makes: precompiled headers, messages of ROS.
ninja -C "$folder" -t targets all |
  sed -n -e 's/^\(.*cmake_pch\.hxx\.pch\): .*/\1/p' -e 's/^\([a-z_]*_files\): .*/\1/p' |
  xargs ninja -C "$folder"

# Each on a line.
commands() {
  sed -n 's/^ *"command": "\(.*\)",\{0,1\}$/\1/p' "$folder/compile_commands.json" |
    sed -e 's/\\"/"/g' -e 's/\\\\/\\/g' |
    grep -v -e 'cmake_pch\.hxx\.pch' -e '/usr/bin/cc '
}
cd "$folder"
commands | tr '\n' '\0' |
  xargs -0 -P "$(nproc)" -n 1 bash -c 'eval "$1 -fsyntax-only" || exit 1' _
