#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# start_test.sh AXISCAL: each program loads only the libraries that it calls. Loading a library
# takes time at each start, so the command itself loads few.
set -euo pipefail
program=$1
folder=$(dirname "$program")
command -v ldd >/dev/null || { echo "skipped: no ldd"; exit 77; }
fail() { echo "start: $1"; exit 1; }

# loads PROGRAM: prints the libraries that the program itself names (NEEDED), without theirs.
loads() { objdump -p "$1" | sed -n 's/^ *NEEDED *//p'; }
# refuses PROGRAM LIBRARY...: fails if the program names one of these libraries.
refuses() {
  local name=$1 library
  shift
  [ -x "$folder/$name" ] || { echo "start: $name is not built"; return; }
  for library in "$@"; do
    ! loads "$folder/$name" | grep -q "^lib$library" || fail "$name loads lib$library"
  done
  echo "start: $name loads $(loads "$folder/$name" | wc -l) libraries by name, $(ldd "$folder/$name" | grep -c '=>') in all"
}

network=(ssl crypto mosquitto iio)
pages=(pango pangocairo cairo gobject qpdf lcms2)
science=(hdf5 matio)
refuses axiscal "${network[@]}" "${pages[@]}" "${science[@]}" pq qrencode archive muparser xlsxwriter ncurses stdc++
refuses axiscal-exchange "${network[@]}" "${pages[@]}" "${science[@]}" ncurses pq
refuses axiscal-store "${network[@]}" "${pages[@]}" "${science[@]}" ncurses xlsxwriter
refuses axiscal-report "${network[@]}" "${science[@]}" ncurses
refuses axiscal-read "${network[@]}" "${pages[@]}" ncurses xlsxwriter
refuses axiscal-acquire "${science[@]}"
# The command may name the C library, libmd (SHA-256) and the libraries that decompress logs.
[ "$(loads "$program" | wc -l)" -le 11 ] || fail "axiscal loads more than it calls: $(loads "$program")"

# The command needs 2,400 relocations. It would need 1,900 more if libstdc++ were a shared library.
LD_DEBUG=statistics "$program" --version 2>&1 >/dev/null | sed -n 's/.*number of relocations: *\([0-9]*\)$/\1/p' | head -n 1 |
  { read -r relocations && [ "$relocations" -le 3000 ] || fail "$relocations relocations"; }

# If a program is not installed, the message names the package that contains it.
copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
cp "$program" "$copy/"
"$copy/axiscal" report record.json -o report.html 2>"$copy/said" && fail "the command does not fail without axiscal-report"
grep -q "axiscal-report is not installed; install the package axiscal-report" "$copy/said" || fail "$(cat "$copy/said")"
