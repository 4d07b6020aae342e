#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, configures, builds and runs every test. Prints ctest's summary; skipped
# tests are listed in it.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/dependencies.sh --python
. scripts/jobs.sh
configure_dev -DAXISCAL_BUILD_PYTHON=ON
cmake --build --preset dev
ctest --preset dev
