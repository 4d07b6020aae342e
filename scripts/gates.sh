#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The short gates behind the tests: each reader under a fuzzer for 12 seconds, and a session whose page is
# attacked. They take the command from the tests' build.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/hostile.sh build/dev/cli/axiscal
scripts/fuzz.sh --seconds 12
