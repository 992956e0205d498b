#!/usr/bin/env bash
# Fits patches to the clouds of a list on a Slurm cluster, as an array of jobs:
#
#   sbatch --array=1-16 samples/cluster/slurm.sh clouds.txt results [options of fit]
#
# The same line again does what is missing: after a preemption (Slurm itself queues those
# again), after a task was killed, with clouds added to the list; with --retry-failed also
# what failed. Give the whole array each time: a part of it would be parts of another
# number.
#SBATCH --job-name=holdfast
#SBATCH --array=1-16
#SBATCH --cpus-per-task=1
#SBATCH --mem=1G
#SBATCH --time=04:00:00
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=holdfast-%A_%a.log
set -euo pipefail

clouds=${1:?list of clouds} results=${2:?folder of results}
shift 2
status=0
"${HOLDFAST:-holdfast}" fit --manifest "$clouds" --resume -o "$results" \
  --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" \
  --threads "${SLURM_CPUS_PER_TASK:-1}" "$@" || status=$?

# 2: all that could be done is done. Clouds without a patch have their NAME.failed.json;
# the task itself is none of those to look after.
((status == 2)) || exit "$status"
