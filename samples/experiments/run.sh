#!/usr/bin/env bash
# Makes every table and picture of this folder anew; each JSON names its command, seed
# and version. Half an hour on two cores.
#
#   samples/experiments/run.sh HOLDFAST [RECORDINGS]
#
# HOLDFAST is the program; RECORDINGS a folder of recorded clouds, without which `real`
# and the recorded half of figure6 are left as they are.
set -euo pipefail
holdfast=$(realpath "$1")
recordings=${2:+$(realpath "$2")}
here=$(dirname "$(realpath "${BASH_SOURCE[0]}")")

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

run() { # FOLDER ARGUMENTS
  local folder=$1
  shift
  "$holdfast" experiment "$@" -o "$here/$folder" > /dev/null
}

# Are the covariances right? By scene; by mode; by departure from the paper.
run . consistency --trials 5000 --seed 7 --options default paper
run modes consistency --trials 5000 --seed 7 --scene table2 robot-1.0 \
  --mode exact gauss_newton second_order stagewise
run departures consistency --trials 5000 --seed 7 --scene robot-1.0 \
  --options without-ray without-debias without-surface-noise without-pca-normal \
  without-smooth-circle
# Views nobody chose; every patch of whole clouds, and by the limits of acceptance; and
# errors that neighbouring pixels share.
run sweep consistency --trials 3000 --seed 7 --scene sweep
run clouds consistency --trials 300 --seed 7 --scene rocks table stairs mix
run limits consistency --trials 300 --seed 7 --scene rocks table stairs mix --limits
run pattern consistency --trials 1000 --seed 7 --scene sweep-1.0 --sensor xtion
# The paper's table and figures, and two questions it leaves open.
run . table1 --trials 10000 --seed 7
run . figure5 --trials 5000 --seed 7
run . neighborhoods --trials 200 --seed 7
# Patches from many views, poses from patches, and maps of whole walks.
run . fusion --seed 7
run . map --seed 7 --stride 3 --scene boulder_field
# Contact risk against draws, and against what happens to feet on maps of walks.
run . risk --seed 7 --trials 12 --frames 16 --stride 3
if [[ -n $recordings ]]; then
  ln -s "$recordings" recordings
  run . figure6 --data recordings
  # Are the covariances right on a real camera? With the pattern of the sensor file, and
  # with that of the other poses.
  run . real --data recordings --seed 7
  run leave_one_out real --data recordings --seed 7 --leave-one-out
  # What a map makes of a camera that stood still.
  run still map --recorded recordings --seed 7
fi
