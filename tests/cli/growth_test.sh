#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# growth_test.sh AXISCAL EXAMPLES: tests the cost of large runs, with all readings in one block and with 12 readings in
# each block.
# If valgrind is installed: eight times as many readings need at most nine times as many instructions.
# 100,008 readings need at most 1 GB of address space. They need at most 140 MB of memory in one block, and 180 MB in
# many.
set -euo pipefail
program=$1
examples=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
fail() { echo "growth: $1"; exit 1; }

"$program" calibrate "$examples/run.csv" --instrument accelerometer -o "$folder/truth.json" >"$folder/log" 2>&1 ||
  { cat "$folder/log"; fail "the example is not calibrated"; }
# run REPLICATES ONE: writes run.csv with the design repeated REPLICATES times: all in one block if ONE is 1, in a block
# each if ONE is 0.
run() {
  "$program" simulate --truth "$folder/truth.json" --noise 1e-4 --slope 0,0 --replicates "$1" -o "$folder/blocks.csv" >"$folder/log" 2>&1 ||
    { cat "$folder/log"; fail "simulate"; }
  awk -F, -v OFS=, -v one="$2" 'NR > 1 && one { $2 = 1 } { print }' "$folder/blocks.csv" >"$folder/run.csv"
}
calibrate=("$program" calibrate "$folder/run.csv" --instrument accelerometer --method known --slope 0,0 --field-magnitude 1
           -o "$folder/cal.json")

for one in 0 1; do
  run 8334 "$one"
  (ulimit -v 1000000 && "${calibrate[@]}" >"$folder/log" 2>&1) || { tail -n 3 "$folder/log"; fail "100,008 readings are not calibrated within 1 GB of address space"; }
  grep -q '"status": "ok"' "$folder/cal.json" || fail "the status of 100,008 good readings is not ok"
  command -v python3 >/dev/null || continue
  memory=$(python3 -c 'import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)' "${calibrate[@]}")
  echo "growth: 100,008 readings take $memory kB, $([ "$one" = 1 ] && echo one block || echo blocks of 12)"
  [ "$memory" -le $((one ? 140000 : 180000)) ] || fail "100,008 readings take $memory kB, more than the limit"
done
command -v valgrind >/dev/null || { echo "growth: only memory was tested: no valgrind"; exit 0; }
instructions() {
  valgrind --tool=callgrind --callgrind-out-file=/dev/null "$@" 2>&1 >/dev/null | sed -n 's/.*Collected : *\([0-9]*\)/\1/p'
}
start=$(instructions "$program" --version)
for one in 0 1; do
  run 21 "$one"
  few=$(($(instructions "${calibrate[@]}") - start))
  run 168 "$one"
  many=$(($(instructions "${calibrate[@]}") - start))
  echo "growth: 252 and 2,016 readings, $([ "$one" = 1 ] && echo one block || echo blocks of 12): $few and $many instructions"
  [ "$many" -le $((9 * few)) ] || fail "eight times as many readings take more than nine times the instructions"
done
