#!/usr/bin/env bash
# 300 small simulated clouds, some of them broken, through a Slurm of one node by
# samples/cluster/slurm.sh: two workers, of which one is killed half-way, and a controller
# that is stopped and started once. Submitted again, every cloud has exactly one result or
# record of failure, and they are those of a run without faults.
#
#   run.sh HOLDFAST SCRATCH     exit code 77: there is no Slurm here
set -uo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
source "$here/slurm_node.sh"
export HOLDFAST=$1
scratch=$2
clouds=300
options=(--spacing 0.1)

fail() {
  echo "FAILED: $*" >&2
  tail -n 5 "$scratch"/slurm/*.out "$scratch"/slurm/*.log "$scratch"/holdfast-*.log >&2
  exit 1
}

obstacle=$(slurm_obstacle)
[[ -z $obstacle ]] || { echo "skipped: $obstacle"; exit 77; }
mkdir -p "$scratch"
find "$scratch" -mindepth 1 -delete
cd "$scratch" || exit 1

make_clouds() {
  "$HOLDFAST" simulate boulder_field --trajectory circle --frames $clouds --stride 8 \
    --step 0.01 -o clouds --quiet || fail "no clouds"
  # A cloud cut short, one without a point, one that is not there, and one of text.
  head -c 20000 clouds/frame_0030.pcd >cut && mv cut clouds/frame_0030.pcd
  : >clouds/frame_0105.pcd
  rm clouds/frame_0210.pcd
  echo "no cloud" >clouds/frame_0299.pcd
  for ((i = 0; i < clouds; ++i)); do printf 'clouds/frame_%04d.pcd\n' $i; done >list.txt
}

# digest FOLDER: what there is of every cloud, without how long it took and where
# the results are.
digest() {
  (
    cd "$1" || exit
    for file in *; do
      case $file in
      *.json) printf '%s %s\n' "$file" "$(grep -v '^"timing"' "$file" | md5sum)" ;;
      *) printf '%s %s\n' "$file" "$(md5sum <"$file")" ;;
      esac
    done
  )
}

each_has_one() {
  local name results records i
  for ((i = 0; i < clouds; ++i)); do
    name=$(printf '%s/frame_%04d' "$1" $i)
    results=$(ls "$name".patches.* 2>/dev/null | wc -l)
    records=$(ls "$name".failed.json 2>/dev/null | wc -l)
    [[ $results.$records == 3.0 || $results.$records == 0.1 ]] ||
      fail "$name has $results files of results and $records records"
  done
}

done_count() {
  find "$1" -name '*.patches.json' -o -name '*.failed.json' 2>/dev/null | wc -l
}

at_least() {
  (($(done_count "$1") >= $2))
}

submit() {
  sbatch --parsable --array=1-2 --time=10 "$here/../../samples/cluster/slurm.sh" \
    list.txt "$1" "${options[@]}" || fail "cannot submit"
}

queue_is_empty() {
  local queue
  queue=$(squeue -h 2>/dev/null) && [[ -z $queue ]]
}

# The process of array task 2; its script says so and ends, too.
kill_second_worker() {
  local worker
  worker=$(pgrep -f -- "--manifest list.txt .*faults.* --shard 2/2" | head -n 1)
  [[ -n $worker ]] || fail "no second worker to kill"
  kill -9 "$worker"
}

make_clouds
slurm_configure "$scratch/slurm" 2
trap stop_slurm EXIT
if ! start_slurm; then
  tail -n 3 slurm/*.out slurm/munge/out
  echo "skipped: Slurm does not start here"
  exit 77
fi

"$HOLDFAST" fit --manifest list.txt -o clean "${options[@]}" --threads 2 2>clean.log
(($? == 2)) || fail "the run without faults"
each_has_one clean

submit faults >/dev/null
wait_for 240 at_least faults $((clouds / 4)) || fail "no results"
kill_second_worker
stop_controller
sleep 1
start_controller
wait_for 240 queue_is_empty || fail "the array does not end"
before=$(done_count faults)
((before < clouds)) || fail "the worker was killed too late"

submit faults >/dev/null
wait_for 240 queue_is_empty || fail "the second array does not end"
each_has_one faults
diff <(digest clean) <(digest faults) >difference || fail "$(head -n 3 difference)"
echo "$before of $clouds clouds after the faults, all after the second run; $SECONDS s"
