#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# growth_test.sh AXISCAL EXAMPLES: what eight times as many readings cost: no more than nine times the instructions, in
# one block or many (where valgrind counts them), and 100,008 of them no more than 1 GB of addresses, and 140 MB of
# memory in one block, 180 in many.
set -euo pipefail
program=$1
examples=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
fail() { echo "growth: $1"; exit 1; }

"$program" calibrate "$examples/run.csv" --instrument accelerometer -o "$folder/truth.json" >"$folder/log" 2>&1 ||
  { cat "$folder/log"; fail "the example"; }
# REPLICATES ONE: the design so often, in a block each or in one.
run() {
  "$program" simulate --truth "$folder/truth.json" --noise 1e-4 --slope 0,0 --replicates "$1" -o "$folder/blocks.csv" >"$folder/log" 2>&1 ||
    { cat "$folder/log"; fail "simulate"; }
  awk -F, -v OFS=, -v one="$2" 'NR > 1 && one { $2 = 1 } { print }' "$folder/blocks.csv" >"$folder/run.csv"
}
calibrate=("$program" calibrate "$folder/run.csv" --instrument accelerometer --method known --slope 0,0 --field-magnitude 1
           -o "$folder/cal.json")

for one in 0 1; do
  run 8334 "$one"
  (ulimit -v 1000000 && "${calibrate[@]}" >"$folder/log" 2>&1) || { tail -n 3 "$folder/log"; fail "100,008 readings, or 1 GB of addresses is too little for them"; }
  grep -q '"status": "ok"' "$folder/cal.json" || fail "100,008 good readings are not good"
  command -v python3 >/dev/null || continue
  memory=$(python3 -c 'import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)' "${calibrate[@]}")
  echo "growth: 100,008 readings take $memory kB, $([ "$one" = 1 ] && echo one block || echo blocks of 12)"
  [ "$memory" -le $((one ? 140000 : 180000)) ] || fail "more memory than they need"
done
command -v valgrind >/dev/null || { echo "growth: memory only: no valgrind"; exit 0; }
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
  [ "$many" -le $((9 * few)) ] || fail "more than nine times"
done
