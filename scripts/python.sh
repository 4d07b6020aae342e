#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the missing packages, builds the Python package and runs an example with it. Afterwards
# `PYTHONPATH=build/release/python python3` can import the package.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/dependencies.sh --python
. scripts/jobs.sh
cmake --preset release -DAXISCAL_BUILD_PYTHON=ON
cmake --build --preset release --target axiscal_python
cd examples
PYTHONPATH=../build/release/python /usr/bin/python3 python/tasks.py
