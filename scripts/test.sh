#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the missing packages, configures, builds and runs all tests. Prints ctest's summary, which lists skipped
# tests.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/dependencies.sh --python
. scripts/jobs.sh
configure_dev -DAXISCAL_BUILD_PYTHON=ON
cmake --build --preset dev
ctest --preset dev
