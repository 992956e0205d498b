#!/usr/bin/env bash
# From a fresh clone to patches: installs what is missing, builds as much of the program
# as a first look needs (its commands fit and info), fits patches to the sample cloud.
#
#   samples/quickstart.sh [-o FOLDER]     results go to FOLDER (./holdfast-quickstart)
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=cmake/setup.sh
source "$root/cmake/setup.sh"

usage() {
  sed -n '2,/^set/{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"
}

results=$PWD/holdfast-quickstart
while getopts "ho:" option; do
  case $option in
  o) results=$OPTARG ;;
  h) usage && exit 0 ;;
  *) usage >&2 && exit 2 ;;
  esac
done
shift $((OPTIND - 1))
(($# == 0)) || { usage >&2 && exit 2; }

install_packages build
# All the rest of the project takes several times as long to compile.
build_in "$root/build-quickstart" -DCMAKE_BUILD_TYPE=Release -DHOLDFAST_QUICKSTART=ON

echo
"$root/build-quickstart/bin/holdfast" fit "$root/samples/rocks.pcd" -o "$results"
echo
echo "Results are in $results:"
ls "$results"
cat <<EOF
The program is $root/build-quickstart/bin/holdfast; try it with --help.
It has the commands fit and info and the covariance modes exact, gauss-newton and
monte-carlo. To build everything, with live, record, render, calibrate, simulate,
experiment, the classes for PCL pipelines, tests and samples:
  cmake -S $root -B $root/build && cmake --build $root/build
EOF
