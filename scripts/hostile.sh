#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# scripts/hostile.sh [AXISCAL] attacks the web page of a session on the loopback interface for a limited time. It checks
# that the user still gets answers, that memory does not grow, and that the session loses no reading.
set -euo pipefail
cd "$(dirname "$0")/.."
axiscal=${1:-build/dev/cli/axiscal}
if ! command -v node >/dev/null; then
  echo "hostile.sh: skipped: node, which runs the attacks, is not installed" >&2
  exit 0
fi
exec node tests/acquisition/hostile.mjs "$axiscal"
