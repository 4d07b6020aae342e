#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs all checks before a change is submitted: format, clang, g++, address and undefined-behaviour sanitizers of both
# compilers, the thread sanitizer, libc++ if it is installed, scripts/gates.sh, each public header compiled alone,
# Doxygen, arm64 and musl (scripts/arm64.sh, scripts/musl.sh), and clang-tidy on the files that differ from origin/main
# (--all: on all files). Needs clang, clang-format, clang-tidy and doxygen in addition to the packages of
# dependencies.sh.
#
# check.sh SUITE [COMPILER ...] runs the README's two commands on a fresh Debian instead: check.sh trixie
set -euo pipefail
cd "$(dirname "$0")/.."

case "${1:-}" in
  "" | --all) ;;
  *) exec scripts/fresh_root.sh "$@" ;;
esac

. scripts/jobs.sh
scripts/format.sh --check
scripts/nested_initialisers.py
scripts/plain_english.py
for preset in dev gcc sanitize sanitize-gcc thread; do
  cmake --workflow --preset "$preset"
done
# Only the objects of the library are compiled: programs would need a GeographicLib that is built with libc++.
if echo '#include <vector>' | clang++ -stdlib=libc++ -std=c++20 -fsyntax-only -x c++ - 2>/dev/null; then
  cmake --workflow --preset libcxx
else
  echo "check.sh: libc++-dev is not installed; the build with libc++ is skipped"
fi
scripts/gates.sh
cmake --build --preset dev --target all_verify_interface_header_sets
doxygen scripts/Doxyfile
scripts/arm64.sh
scripts/musl.sh

if [ "${1:-}" = --all ]; then
  files=$(git ls-files '*.cpp')
else
  base=$(git merge-base HEAD origin/main 2>/dev/null || git rev-list --max-parents=0 HEAD | tail -n 1)
  files=$(git diff --name-only --diff-filter=d "$base" -- '*.cpp')
fi
files=$(printf '%s\n' "$files" | grep -v '^tests/install/' || true)
if [ -n "$files" ]; then
  printf '%s\n' "$files" | xargs -P "$(nproc)" -n 4 clang-tidy -p build/sanitize --quiet
fi
