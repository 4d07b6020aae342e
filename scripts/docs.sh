#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the documentation site in build/site with mkdocs-material, and the reference of the library with Doxygen.
# Installs both programs from the distribution if they are missing.
set -euo pipefail
cd "$(dirname "$0")/.."

missing=()
command -v doxygen >/dev/null || missing+=(doxygen)
command -v mkdocs >/dev/null || missing+=(mkdocs)
python=/usr/bin/python3  # the distribution installs mkdocs for this Python
[ "$(dpkg-query -W -f '${db:Status-Status}' mkdocs-material 2>/dev/null)" = installed ] || missing+=(mkdocs-material)
if [ ${#missing[@]} -gt 0 ]; then
  echo "docs.sh: installing ${missing[*]}"
  as_root=()
  [ "$(id -u)" -eq 0 ] || as_root=(sudo)
  "${as_root[@]}" apt-get update -q
  DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -q --no-install-recommends "${missing[@]}"
fi
"$python" -m mkdocs build --quiet
doxygen scripts/Doxyfile
rm -rf build/site/reference
cp -r build/doxygen/html build/site/reference
echo "docs.sh: the site is in build/site; to read it run: python3 -m http.server --directory build/site 8000, and open http://localhost:8000"
