#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# scripts/hostile.sh [AXISCAL]: attacks the page of a session on loopback, bounded in number and time, and
# sees that its user is answered, that memory stays, and that the session beside it loses nothing.
set -euo pipefail
cd "$(dirname "$0")/.."
axiscal=${1:-build/dev/cli/axiscal}
if ! command -v node >/dev/null; then
  echo "hostile.sh: skipped: there is no node, which plays the attackers" >&2
  exit 0
fi
exec node tests/acquisition/hostile.mjs "$axiscal"
