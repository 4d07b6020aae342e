#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# hardening_test.sh AXISCAL OBJECTS: reads from ELF files whether the command is hardened as in a
# Linux distribution. The command is position independent, has full RELRO, a stack protector and
# fortified calls. On x86-64 the project's own object files have control-flow protection.
set -euo pipefail
program=$1
objects=$2
command -v readelf >/dev/null || { echo "skipped: no readelf (binutils)"; exit 77; }
fail() { echo "hardening: $1"; exit 1; }

header=$(readelf -hW "$program")
segments=$(readelf -lW "$program")
dynamic=$(readelf -dW "$program")
symbols=$(readelf -sW --dyn-syms "$program")
grep -q 'Type: *DYN' <<<"$header" || fail "not position independent"
grep -q 'GNU_RELRO' <<<"$segments" || fail "no RELRO"
grep -qE 'BIND_NOW|FLAGS.*NOW' <<<"$dynamic" || fail "relocations are not bound at start (BIND_NOW)"
grep -E 'GNU_STACK' <<<"$segments" | grep -q 'RW ' || fail "the stack is executable"
grep -q '__stack_chk_fail' <<<"$symbols" || fail "no stack protector"
grep -qE '__(mem|str|sn?printf|vsn?printf|read|fprintf|longjmp|realpath|poll|recv)[a-z]*_chk' <<<"$symbols" || fail "no fortified call"

if grep -q 'X86-64' <<<"$header"; then
  count=0
  for module in core calib cli logs acquisition; do
    [ -d "$objects/$module" ] || continue
    found=0
    while IFS= read -r object; do
      notes=$(readelf -nW "$object" 2>/dev/null)
      grep -q 'IBT' <<<"$notes" && grep -q 'SHSTK' <<<"$notes" || fail "$object has no control-flow protection"
      found=$((found + 1))
    done < <(find "$objects/$module" -path '*axiscal*.dir*' -name '*.o')
    # One object file may combine several sources (CMAKE_UNITY_BUILD), but each module has at least
    # one.
    [ "$found" -gt 0 ] || fail "no object file of $module was found"
    count=$((count + found))
  done
  echo "hardening: $count object files with control-flow protection"
fi
echo "hardening: full RELRO, PIE, stack protector, FORTIFY"
