#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Compiles the library proper and its vector kernels for arm64, and runs the kernels' tests in an emulator. Needs
# Debian's g++-aarch64-linux-gnu (or crossbuild-essential-arm64), qemu-user and googletest. The headers of the other
# libraries are this machine's: they are the same on both.
set -euo pipefail
cd "$(dirname "$0")/.."

. scripts/jobs.sh
for program in aarch64-linux-gnu-g++ qemu-aarch64; do
  command -v "$program" >/dev/null || {
    echo "arm64.sh: $program is missing; install crossbuild-essential-arm64 and qemu-user" >&2
    exit 1
  }
done
# The preset names the compiler.
env -u CXX cmake --preset arm64 "-Dfmt_DIR=/usr/lib/$(uname -m)-linux-gnu/cmake/fmt"
cmake --build --preset arm64

googletest=/usr/src/googletest
aarch64-linux-gnu-g++ -std=c++20 -O1 -pthread -I . -I kernels/include -I core/include \
  -I build/arm64/core/include -isystem /usr/include/eigen3 \
  -I "$googletest/googletest" -I "$googletest/googletest/include" -I "$googletest/googlemock" \
  -I "$googletest/googlemock/include" tests/kernels/kernels_test.cpp "$googletest/googletest/src/gtest-all.cc" \
  "$googletest/googlemock/src/gmock-all.cc" "$googletest/googlemock/src/gmock_main.cc" \
  build/arm64/kernels/libaxiscal_kernels.a build/arm64/core/libaxiscal_core.a -o build/arm64/kernels_test
qemu-aarch64 -L /usr/aarch64-linux-gnu build/arm64/kernels_test
