#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The short gates behind the tests: a session whose page is attacked, speed beside its peers, and each reader
# under a fuzzer for 4 seconds. They take the command from the tests' build.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/hostile.sh build/dev/cli/axiscal
# Small sizes, goals loosened by a third; what the machine's noise takes from one try it may not take from all.
if /usr/bin/python3 -c 'import numpy' 2>/dev/null; then
  . scripts/jobs.sh
  configure_dev -DAXISCAL_BUILD_BENCH=ON >/dev/null
  cmake --build --preset dev --target axiscal_bench
  for try in 1 2 3; do
    /usr/bin/python3 bench/gate.py build/dev --loosen 0.34 && break
    [ "$try" -lt 3 ] || { echo "gates.sh: slower than its peers, three times"; exit 1; }
  done
else
  echo "gates.sh: speed skipped: there is no python3-numpy"
fi
scripts/fuzz.sh --seconds 4
