#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# scripts/fuzz.sh MINUTES | --seconds N | --inputs N [TARGET ...] runs all readers, or the named TARGETs, with libFuzzer
# and the address and undefined-behaviour sanitizers, two at a time. The limit is MINUTES for all readers together, or
# N seconds or N inputs for each reader. The first inputs are those in tests/fuzz/corpus and, if they exist, real files
# of AXISCAL_DATA_DIR (../shared/data). New inputs are kept in build/fuzz/corpus. If an input crashes a reader, takes
# over 10 s or 1 GiB, or causes an exception that is not Axiscal's, it is kept in build/fuzz/found and the status is 1.
set -euo pipefail
cd "$(dirname "$0")/.."

packages=()
command -v clang++ >/dev/null || packages+=(clang)
# In Debian the sanitizers' runtime has a separate package; other distributions include it in the compiler's.
if ! clang++ -print-file-name=libclang_rt.fuzzer-x86_64.a 2>/dev/null | grep -q / &&
  apt-cache show libclang-rt-dev >/dev/null 2>&1; then
  packages+=(libclang-rt-dev)
fi
if [ ${#packages[@]} -gt 0 ]; then
  echo "fuzz.sh: installing ${packages[*]}"
  as_root=()
  [ "$(id -u)" -eq 0 ] || as_root=(sudo)
  "${as_root[@]}" apt-get update -q
  DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -q --no-install-recommends "${packages[@]}"
fi

. scripts/jobs.sh
cmake --preset fuzz
cmake --build --preset fuzz
program=$PWD/build/fuzz/tests/fuzz/axiscal_fuzz
mapfile -t targets < <("$program" --list)
case "${1:-}" in
  --seconds) bound=-max_total_time=$2 && shift 2 ;;
  --inputs) bound=-runs=$2 && shift 2 ;;
  *) bound=-max_total_time=$((${1:?minutes} * 60 * 2 / ${#targets[@]})) && shift ;;
esac
[ $# -eq 0 ] || targets=("$@")

# Copies the first BYTES of each real file as a seed, or the whole file if BYTES is 0 (the format needs its end):
# seeds_of TARGET BYTES FIND-EXPRESSION...
data=${AXISCAL_DATA_DIR:-../shared/data}
seeds_of() {
  local target=$1 bytes=$2
  shift 2
  mkdir -p "build/fuzz/seeds/$target"
  [ -d "$data" ] || return 0
  find "$data" -type f \( "$@" \) | while IFS= read -r file; do
    if [ "$bytes" -gt 0 ]; then
      head -c "$bytes" "$file" >"build/fuzz/seeds/$target/$(basename "$file")"
    elif [ "$(stat -c %s "$file")" -le 200000 ]; then
      cp "$file" "build/fuzz/seeds/$target/"
    fi
  done
}
start=16384
seeds_of ulog $start -name '*.ulg'
seeds_of dataflash $start -name '*.bin'
seeds_of rosbag1 $start -name '*.bag'
seeds_of mcap $start -name '*.mcap'
seeds_of blackbox $start -iname '*.bbl' -o -iname '*.bfl'
seeds_of tlog $start -name '*.tlog'
seeds_of log $start -name '*.csv' -o -name '*.txt' -o -name '*.log'
seeds_of table $start -name '*.csv'
seeds_of json 0 -name '*.json'
seeds_of zip 0 -name '*.npz' -o -name '*.zip' -o -name '*.xlsx'
seeds_of rosbag2 0 -name '*.db3'
seeds_of mat 0 -path '*matlab5*' -name '*.mat'
seeds_of mat73 0 -path '*matlab73*' -name '*.mat'

logs=build/fuzz/logs
mkdir -p "$logs" build/fuzz/found
run_target() {
  local target=$1
  local corpus=build/fuzz/corpus/$target
  mkdir -p "$corpus" "tests/fuzz/corpus/$target" "build/fuzz/seeds/$target"
  # At least the length of the longest seed, so that libFuzzer does not truncate a seed.
  local longest
  longest=$(find "tests/fuzz/corpus/$target" "build/fuzz/seeds/$target" -type f -printf '%s\n' | sort -n | tail -n 1)
  local max_len=$((${longest:-0} > 8192 ? longest : 8192))
  ln -sf "$program" "build/fuzz/fuzz_$target"
  ASAN_OPTIONS=quarantine_size_mb=32 "build/fuzz/fuzz_$target" "$bound" -timeout=10 -rss_limit_mb=1024 \
    -max_len="$max_len" -print_final_stats=1 -artifact_prefix="build/fuzz/found/$target-" "$corpus" \
    "tests/fuzz/corpus/$target" "build/fuzz/seeds/$target" >"$logs/$target.log" 2>&1 ||
    { echo "$target" >>"$logs/failed"; tail -n 40 "$logs/$target.log"; }
}
export -f run_target
export program bound logs
rm -f "$logs/failed"
printf '%s\n' "${targets[@]}" | xargs -P 2 -I TARGET bash -c 'run_target TARGET'

total=0
for target in "${targets[@]}"; do
  count=$(sed -n 's/^stat::number_of_executed_units: *//p' "$logs/$target.log")
  total=$((total + ${count:-0}))
  printf '%-16s %10s inputs\n' "$target" "${count:-none}"
done
if [ -e "$logs/failed" ]; then
  echo "fuzz.sh: FAILED: $(tr '\n' ' ' <"$logs/failed"); the inputs are in build/fuzz/found, the logs in $logs"
  exit 1
fi
echo "fuzz.sh: no failure in $total inputs to ${#targets[@]} readers"
