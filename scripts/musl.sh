#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Compiles the library without the tools with the headers of musl and of LLVM's C++ library. Debian has no C++ library
# for musl, so no program is linked. Needs the Debian packages musl-dev, libc++-dev and clang.
set -euo pipefail
cd "$(dirname "$0")/.."

. scripts/jobs.sh
musl=/usr/include/$(uname -m)-linux-musl
libcxx=$(ls -d /usr/lib/llvm-*/include/c++/v1 2>/dev/null | sort -V | tail -n 1)
[ -d "$musl" ] && [ -d "$libcxx" ] || {
  echo "musl.sh: install musl-dev and libc++-dev" >&2
  exit 1
}
# Links to the headers of the third-party libraries, because /usr/include also contains the headers of glibc.
include=build/musl/include
rm -rf $include
mkdir -p $include/libraries
ln -s "$libcxx" $include/c++
ln -s "$musl" $include/musl
for headers in boost fmt nlohmann GeographicLib; do
  ln -s "/usr/include/$headers" "$include/libraries/$headers"
done
# fmt_DIR is set because CMake searches only the folders of the musl machine type.
env -u CXX cmake --preset musl "-Dfmt_DIR=/usr/lib/$(uname -m)-linux-gnu/cmake/fmt"
cmake --build --preset musl
