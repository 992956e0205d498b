#!/usr/bin/env bash
# Makes every picture of this folder anew, in seconds.
#
#   samples/pictures/run.sh HOLDFAST [mosd_cyl_learn44.pcd]     the program, and for the
#                                                               table its recording
set -euo pipefail
holdfast=$(realpath "$1")
recording=${2:+$(realpath "$2")}
here=$(dirname "$(realpath "${BASH_SOURCE[0]}")")

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

"$holdfast" render --types -o "$here/types.png" --size 880x400
"$holdfast" simulate rocks -o rocks.pcd
"$holdfast" fit rocks.pcd -o . --quiet --radius 0.045 --spacing 0.1
"$holdfast" render rocks.patches.json -o "$here/rocks.png" --size 800x590
"$holdfast" render rocks.patches.json -o "$here/rocks_sigma.png" --size 800x610 \
  --color sigma-normal

[[ -n $recording ]] || exit 0
for kind in "" _independent; do
  "$holdfast" fit "$recording" --sensor xtion ${kind:+--no-pattern} -o . --quiet
  "$holdfast" render "$(basename "$recording" .pcd).patches.json" \
    -o "$here/table$kind.png" --size 800x600
done
