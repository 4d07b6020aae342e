#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Formats all C++ files in place. With --check it changes no file and reports the files that are not formatted.
set -euo pipefail
cd "$(dirname "$0")/.."
mode=(-i)
[ "${1:-}" != --check ] || mode=(--dry-run --Werror)
git ls-files -co --exclude-standard '*.hpp' '*.cpp' | xargs clang-format "${mode[@]}"
