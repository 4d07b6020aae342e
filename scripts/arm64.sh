#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Compiles the library, the command and the tests of core and kernels for arm64. Then an emulator runs these tests and a
# calibration. The arm64 libraries come from Debian; they stay in AXISCAL_ROOTS (/var/tmp/axiscal-roots) for the next
# run. Needs root and the Debian packages g++-aarch64-linux-gnu, qemu-user and debootstrap.
set -euo pipefail
cd "$(dirname "$0")/.."

. scripts/jobs.sh
for program in aarch64-linux-gnu-g++ qemu-aarch64 debootstrap; do
  command -v "$program" >/dev/null || {
    echo "arm64.sh: $program is missing; install g++-aarch64-linux-gnu, qemu-user and debootstrap" >&2
    exit 1
  }
done

suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
sysroot=${AXISCAL_ROOTS:-/var/tmp/axiscal-roots}/$suite-arm64
libraries=libc6-dev,libgeographiclib-dev,libfmt-dev,libmd-dev,zlib1g-dev,libbz2-dev,liblzma-dev,libminizip-dev
libraries+=,liblz4-dev,libzstd-dev,libsqlite3-dev,libeigen3-dev,nlohmann-json3-dev,libboost-dev,libcli11-dev
libraries+=,libpugixml-dev,libyaml-cpp-dev,libxlsxwriter-dev,libgtest-dev,libgmock-dev
if [ ! -e "$sysroot/.complete" ]; then
  rm -rf "$sysroot"
  mkdir -p "$sysroot"
  # --foreign downloads the packages without running their scripts. The compiler needs only their files.
  debootstrap --foreign --arch=arm64 --variant=minbase "--include=$libraries" "$suite" "$sysroot"
  for package in "$sysroot"/var/cache/apt/archives/*.deb; do
    dpkg-deb -x "$package" "$sysroot"
  done
  touch "$sysroot/.complete"
fi

# CXX is unset, because the preset sets the compiler.
env -u CXX PKG_CONFIG_SYSROOT_DIR="$sysroot" PKG_CONFIG_LIBDIR="$sysroot/usr/lib/aarch64-linux-gnu/pkgconfig" \
  cmake --preset arm64 "-DCMAKE_SYSROOT=$sysroot" "-DCMAKE_FIND_ROOT_PATH=$sysroot" \
  "-DCMAKE_CROSSCOMPILING_EMULATOR=qemu-aarch64;-L;$sysroot"
cmake --build --preset arm64 -- -k 0

emulated() { qemu-aarch64 -L "$sysroot" "$@"; }
# The test NeedsNoThreads is left out: it limits the memory of its process, and the emulator runs in that process.
emulated build/arm64/tests/core_test --gtest_filter=-ForEachInParallel.NeedsNoThreads
emulated build/arm64/tests/kernels_test
work=build/arm64/files
mkdir -p "$work"
emulated build/arm64/cli/axiscal calibrate examples/run.csv --instrument accelerometer --unit V -o $work/cal.json
emulated build/arm64/cli/axiscal apply $work/cal.json examples/run.csv -o $work/angles.csv
head -n 3 $work/angles.csv
