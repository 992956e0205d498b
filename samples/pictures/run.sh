#!/usr/bin/env bash
# Makes every picture of this folder anew, in seconds.
#
#   samples/pictures/run.sh HOLDFAST [RECORDINGS]     the program, and for the table and
#                                                     the carpet the folder of recordings
set -euo pipefail
holdfast=$(realpath "$1")
recordings=${2:+$(realpath "$2")}
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

[[ -n $recordings ]] || exit 0
# picture RECORDING NAME [options of fit]
picture() {
  "$holdfast" fit "$recordings/$1.pcd" -o . --quiet "${@:3}"
  "$holdfast" render "$1.patches.json" -o "$here/$2.png" --size 800x600
}
picture mosd_cyl_learn44 table --sensor xtion
picture mosd_cyl_learn44 table_independent --sensor xtion --no-pattern
picture pcl_milk_clorox_carpet carpet
picture pcl_milk_clorox_carpet carpet_discs --neighborhood disc --accept all
