#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Short checks to run after the tests: attacks on the web page of a session, speed compared with other libraries, and
# 4 seconds of fuzzing for each reader. The command comes from the tests' build folder.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/hostile.sh build/dev/cli/axiscal
# Small sizes, with goals loosened by 34 %. The check fails only if all three tries miss a goal, because other load on
# the machine can slow down one try.
if /usr/bin/python3 -c 'import numpy' 2>/dev/null; then
  . scripts/jobs.sh
  configure_dev -DAXISCAL_BUILD_BENCH=ON >/dev/null
  cmake --build --preset dev --target axiscal_bench
  for try in 1 2 3; do
    /usr/bin/python3 bench/gate.py build/dev --loosen 0.34 && break
    [ "$try" -lt 3 ] || { echo "gates.sh: a speed goal of bench/gate.py was missed in three tries"; exit 1; }
  done
else
  echo "gates.sh: the speed check is skipped: python3-numpy is not installed"
fi
scripts/fuzz.sh --seconds 4
