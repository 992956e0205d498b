#!/usr/bin/env bash
# Makes every picture of this folder anew, in a minute.
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

# The page of a report, as a browser shows it; pngquant, where it is, makes it smaller.
if command -v chromium >/dev/null; then
  mkdir page
  "$holdfast" fit "$here/../rocks.pcd" -o page --quiet --radius 0.06 --spacing 0.11
  "$holdfast" report page/rocks.patches.json --cloud "$here/../rocks.pcd" -o page.html
  chromium --headless --no-sandbox --use-gl=angle --use-angle=swiftshader \
    --enable-unsafe-swiftshader --hide-scrollbars --window-size=1100,800 \
    --virtual-time-budget=20000 --screenshot="$here/report.png" \
    "file://$work/page.html#patch=140" 2>/dev/null
  ! command -v pngquant >/dev/null || pngquant --force --ext .png "$here/report.png"
fi

# Where a flat foot may step, from one frame of a camera that looks down by 45 degrees,
# and from a map of twelve.
"$holdfast" simulate boulder_field --trajectory walk --frames 12 --stride 2 -o walk
"$holdfast" risk walk/frame_0008.pcd --foot humanoid_foot --spacing 0.2 \
  --load-direction 0 1 1 -o risk.json --quiet
"$holdfast" render risk.json -o "$here/risk.png" --size 640x480 --color risk
"$holdfast" map walk --poses walk/trajectory.txt --radius 0.13 -o walk.map --quiet
"$holdfast" risk walk.map --foot humanoid_foot --best 25 --spacing 0.15 \
  -o risk_map.json --quiet
"$holdfast" render risk_map.json -o "$here/risk_map.png" --size 720x480 --color risk

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
