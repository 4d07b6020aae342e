#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, configures, builds and runs every test. Prints ctest's summary; skipped
# tests are listed in it.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/dependencies.sh
. scripts/jobs.sh
# A compiler that we have not seen may warn of something new; that is no failure of a user's build.
strict=(--compile-no-warning-as-error)
[ -z "${CI:-}" ] || strict=()
cmake --preset dev "${strict[@]}"
cmake --build --preset dev
ctest --preset dev
