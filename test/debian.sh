#!/usr/bin/env bash
# Builds the packages of debian/ as Debian does, from an archive of what is committed, and
# tries them. By hand, since it compiles everything once more; the test `packages` tries
# those that cpack makes of a build.
#
#   test/debian.sh [FOLDER]         packages go to FOLDER (build-debian)
#
# CXX launchers: HOLDFAST_CMAKE_ARGS=-DCMAKE_CXX_COMPILER_LAUNCHER=ccache
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=cmake/setup.sh
source "$root/cmake/setup.sh"
folder=$(realpath -m "${1:-$root/build-debian}")

install_packages build python package
rm -rf "$folder/main" "$folder"/*.deb
mkdir -p "$folder/main"
git -C "$root" archive HEAD | tar -x -C "$folder/main"
(cd "$folder/main" && dpkg-buildpackage --build=binary --unsigned-source --unsigned-changes \
  --no-pre-clean)
version=$(dpkg-parsechangelog -l "$folder/main/debian/changelog" -S Version)
changes=$folder/holdfast_${version}_$(dpkg --print-architecture).changes
lintian --allow-root --fail-on error --tag-display-limit 0 "$changes"
# Without those of debugging symbols.
mapfile -t debs < <(find "$folder" -maxdepth 1 -name '*.deb' ! -name '*-dbgsym_*' | sort)
"$root/test/support/try_packages.sh" "$folder" "${debs[@]}"
