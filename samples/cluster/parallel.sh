#!/usr/bin/env bash
# The same by GNU parallel on one machine: parallel.sh clouds.txt results [options of fit]
export clouds=$1 results=$2 parts=$((4 * $(nproc)))
shift 2
seq "$parts" | parallel --halt soon,fail=1 "${HOLDFAST:-holdfast}" fit --manifest "$clouds" \
  --shard "{}/$parts" --resume --threads 1 -o "$results" "$@" '||' '[ $? = 2 ]'
