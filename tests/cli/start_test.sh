#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# start_test.sh AXISCAL: each program loads the libraries that it calls, and no others. Every library
# costs each start its loading, so the command itself has few.
set -euo pipefail
program=$1
folder=$(dirname "$program")
command -v ldd >/dev/null || { echo "skipped: no ldd"; exit 77; }
fail() { echo "start: $1"; exit 1; }

# loads PROGRAM: the libraries that it names itself.
loads() { objdump -p "$1" | sed -n 's/^ *NEEDED *//p'; }
# refuses PROGRAM LIBRARY...: it names none of these.
refuses() {
  local name=$1 library
  shift
  [ -x "$folder/$name" ] || { echo "start: $name is not built"; return; }
  for library in "$@"; do
    ! loads "$folder/$name" | grep -q "^lib$library" || fail "$name loads lib$library"
  done
  echo "start: $name loads $(loads "$folder/$name" | wc -l) libraries by name, $(ldd "$folder/$name" | grep -c '=>') in all"
}

network=(ssl crypto mosquitto iio qrencode)
pages=(pango pangocairo cairo gobject qpdf lcms2)
science=(hdf5 matio)
refuses axiscal "${network[@]}" "${pages[@]}" "${science[@]}" archive muparser xlsxwriter ncurses stdc++
refuses axiscal-exchange "${network[@]}" "${pages[@]}" "${science[@]}" ncurses
refuses axiscal-report "${network[@]}" "${science[@]}" ncurses
refuses axiscal-read "${network[@]}" "${pages[@]}" ncurses xlsxwriter
refuses axiscal-acquire "${science[@]}"
# The C library, SHA-256 (libmd), and what unpacks logs.
[ "$(ldd "$program" | grep -c '=>')" -le 10 ] || fail "axiscal loads more than it calls: $(ldd "$program")"

# 2,400 of them; with libstdc++ as a library of its own, 1,900 more.
LD_DEBUG=statistics "$program" --version 2>&1 >/dev/null | sed -n 's/.*number of relocations: *\([0-9]*\)$/\1/p' | head -n 1 |
  { read -r relocations && [ "$relocations" -le 3000 ] || fail "$relocations relocations"; }

# A program that is not installed is named with its package.
copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
cp "$program" "$copy/"
"$copy/axiscal" report record.json -o report.html 2>"$copy/said" && fail "no axiscal-report, and no error"
grep -q "axiscal-report is not installed; install the package axiscal-report" "$copy/said" || fail "$(cat "$copy/said")"
