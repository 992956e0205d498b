#!/usr/bin/env bash
# The packages that cpack makes of what is built, tried by try_packages.sh.
#
#   check_packages.sh BUILD SCRATCH      exits with 77 where a tool is missing
set -euo pipefail
build=$1 scratch=$2

for tool in cpack dpkg dpkg-deb dpkg-shlibdeps pkg-config; do
  if ! command -v $tool >/dev/null; then
    echo "$tool is not installed"
    exit 77
  fi
done

rm -rf "$scratch"
mkdir -p "$scratch/packages"
(cd "$scratch" && cpack -G DEB --config "$build/CPackConfig.cmake" -B "$scratch/packages" \
  >cpack.log 2>&1) || { cat "$scratch/cpack.log"; exit 1; }
"$(dirname "${BASH_SOURCE[0]}")/try_packages.sh" "$scratch" "$scratch"/packages/*.deb
