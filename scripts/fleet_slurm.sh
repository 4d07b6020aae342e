#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Calibrates a fleet on a Slurm cluster: one array task per shard, then one job that joins the parts.
#
#   fleet_slurm.sh [-n SHARDS] [-o FOLDER] [-s STORE] UNITS.csv CALIBRATE_OPTION..
#
# FOLDER [fleet] receives records.jsonl and units.csv. STORE is FILE.db on a file system that locks, or
# postgresql://..; all tasks write to it. A task that was killed is requeued by Slurm, and goes on after its last
# complete line. Prints the number of the job that ends last; `sbatch --dependency=afterok:NUMBER` waits for it.
#
#   scripts/fleet_slurm.sh -n 16 -o fleet units.csv --instrument accelerometer --unit V
set -euo pipefail

# The three parts of this script: submit, one shard, merge.
case "${1:-}" in
  --shard)
    shards=$2 folder=$3 store=$4 units=$5
    shift 5
    part=$folder/part-$SLURM_ARRAY_TASK_ID
    outputs=(-o "$part.jsonl" --table "$part.csv")
    [ -z "$store" ] || outputs+=(--store "$store")
    status=0
    "${AXISCAL:-axiscal}" calibrate "$units" --stream --resume --shard "$SLURM_ARRAY_TASK_ID/$shards" \
      "${outputs[@]}" "$@" || status=$?
    # 1: units that failed are results too.
    [ "$status" -le 1 ] || exit "$status"
    exit 0
    ;;
  --merge)
    shards=$2 folder=$3
    jsonl=() csv=()
    for part in $(seq "$shards"); do
      jsonl+=("$folder/part-$part.jsonl")
      csv+=("$folder/part-$part.csv")
    done
    "${AXISCAL:-axiscal}" merge "${jsonl[@]}" -o "$folder/records.jsonl"
    "${AXISCAL:-axiscal}" merge "${csv[@]}" -o "$folder/units.csv"
    rm "${jsonl[@]}" "${csv[@]}"
    exit 0
    ;;
esac

shards=4 folder=fleet store=
while getopts n:o:s: option; do
  case $option in
    n) shards=$OPTARG ;;
    o) folder=$OPTARG ;;
    s) store=$OPTARG ;;
    *) sed -n '3,13s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
  esac
done
shift $((OPTIND - 1))
if [ $# -lt 1 ] || [ ! -r "$1" ]; then
  sed -n '3,13s/^# \{0,1\}//p' "$0" >&2
  exit 2
fi
command -v sbatch >/dev/null || { echo "fleet_slurm.sh: sbatch is not installed (package slurm-client)" >&2; exit 1; }
mkdir -p "$folder"
self=$(realpath "$0")
array=$(sbatch --parsable --requeue --job-name=axiscal --array="1-$shards" --output="$folder/part-%a.log" \
  "$self" --shard "$shards" "$folder" "$store" "$@")
sbatch --parsable --job-name=axiscal-merge --dependency="afterok:$array" --output="$folder/merge.log" \
  "$self" --merge "$shards" "$folder"
