#!/bin/sh
# What `holdfast live` reaches on this computer, with the virtual camera (640x480, 30
# Hz, depth with the noise of a Kinect) running on it, too: a minute of 300 patches of
# about 400 points a frame, then ten seconds each of more and more.
#
#   test/benchmark/live.sh [BUILD]
set -eu
build=${1:-build}
export LD_LIBRARY_PATH="$build/test/virtual_kinect/root"

live() {
  echo "== live $*"
  "$build/bin/holdfast" live --radius 0.022 "$@"
}

live --max-patches 300 --seconds 60
for patches in 500 1000 1500 2000; do
  live --max-patches "$patches" --budget-ms 33 --seconds 10
done
