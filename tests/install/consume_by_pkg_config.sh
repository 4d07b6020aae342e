#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# usage: consume_by_pkg_config.sh SCRATCH MAIN.CPP VERSION
# Links the program once with the whole library and once with only the module that it needs, and
# runs it.
set -euo pipefail
pc=$(find "$1/prefix" -name axiscal.pc)
export PKG_CONFIG_PATH="${pc%/*}"
for package in axiscal axiscal-calib; do
  flags=$(pkg-config --cflags --libs "$package")
  [ "$(pkg-config --modversion "$package")" = "$3" ]
  # shellcheck disable=SC2086
  "${CXX:-g++}" -std=c++20 -O1 "$2" -o "$1/by_pkg_config" $flags
  "$1/by_pkg_config" 30.0000
done
