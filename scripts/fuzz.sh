#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# scripts/fuzz.sh MINUTES | --seconds N: every reader under libFuzzer with address and undefined-behaviour
# sanitizers, two at a time; MINUTES for all together, or N seconds for each. It begins with the inputs in
# tests/fuzz/corpus and keeps what it finds in build/fuzz/corpus. An input that crashes, hangs (10 s), takes
# over 1 GiB or ends in a foreign exception is kept in build/fuzz/found, and the status is 1.
set -euo pipefail
cd "$(dirname "$0")/.."

packages=()
command -v clang++ >/dev/null || packages+=(clang)
# Debian parts the sanitizers' runtime from the compiler; elsewhere they are one.
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
  --seconds) seconds=$2 ;;
  *) seconds=$((${1:?minutes} * 60 * 2 / ${#targets[@]})) ;;
esac

logs=build/fuzz/logs
mkdir -p "$logs" build/fuzz/found
run_target() {
  local target=$1
  local corpus=build/fuzz/corpus/$target
  mkdir -p "$corpus" "tests/fuzz/corpus/$target"
  ln -sf "$program" "build/fuzz/fuzz_$target"
  ASAN_OPTIONS=quarantine_size_mb=32 "build/fuzz/fuzz_$target" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=1024 -max_len=8192 \
    -print_final_stats=1 -artifact_prefix="build/fuzz/found/$target-" "$corpus" \
    "tests/fuzz/corpus/$target" >"$logs/$target.log" 2>&1 ||
    { echo "$target" >>"$logs/failed"; tail -n 40 "$logs/$target.log"; }
}
export -f run_target
export program seconds logs
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
echo "fuzz.sh: $total inputs over ${#targets[@]} readers, none of which failed"
