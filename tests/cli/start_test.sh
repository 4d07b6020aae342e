#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# start_test.sh AXISCAL: the command starts with few libraries (each costs every call its loading) and none
# that only some commands need; those are loaded when they are called.
set -euo pipefail
program=$1
command -v ldd >/dev/null || { echo "skipped: no ldd"; exit 77; }
fail() { echo "start: $1"; exit 1; }

libraries=$(ldd "$program" | grep '=>' | sed 's/ *=>.*//; s/^[[:space:]]*//')
count=$(wc -l <<<"$libraries")
[ "$count" -le 12 ] || fail "$count libraries: $(tr '\n' ' ' <<<"$libraries")"
for late in archive cairo crypto hdf5 iio matio mosquitto muparser pango qpdf qrencode sqlite3 ssl xlsxwriter; do
  ! grep -q "^lib$late" <<<"$libraries" || fail "lib$late is loaded before it is called"
done
# 470 of them; with libstdc++ as a library of its own, 2,300.
most=1500
grep -q '^libstdc++' <<<"$libraries" && most=8000
LD_DEBUG=statistics "$program" --version 2>&1 >/dev/null | sed -n 's/.*number of relocations: *\([0-9]*\)$/\1/p' | head -n 1 |
  { read -r relocations && [ "$relocations" -le "$most" ] || fail "$relocations relocations"; }
echo "start: $count libraries"
