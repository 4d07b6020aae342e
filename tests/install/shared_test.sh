#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# shared_test.sh SOURCE SCRATCH VERSION: builds the library as one shared library within another project
# (add_subdirectory). It is then installed and used by find_package and by pkg-config. It loads no library
# that only the tools need.
set -euo pipefail
source=$(realpath "$1")
scratch=$2
version=$3
. "$source/scripts/jobs.sh"
rm -rf "$scratch"
mkdir -p "$scratch/project"
fail() { echo "shared: $1"; exit 1; }

cat >"$scratch/project/CMakeLists.txt" <<CMAKE
cmake_minimum_required(VERSION 3.25)
project(project LANGUAGES CXX)
set(AXISCAL_INSTALL ON)
add_subdirectory("$source" axiscal)
add_executable(consumer "$source/tests/install/consumer/main.cpp")
target_link_libraries(consumer PRIVATE axiscal::library)
CMAKE
cmake -S "$scratch/project" -B "$scratch/build" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS=-O0 \
  -DCMAKE_UNITY_BUILD=ON -DBUILD_SHARED_LIBS=ON "-DCMAKE_INSTALL_PREFIX=$scratch/prefix" >"$scratch/configure.log"
cmake --build "$scratch/build" >"$scratch/build.log" || { tail -n 40 "$scratch/build.log"; exit 1; }
"$scratch/build/consumer" 30.0000
cmake --install "$scratch/build" >/dev/null

library=$(find "$scratch/prefix" -name 'libaxiscal.so')
[ -n "$library" ] || fail "no libaxiscal.so is installed"
find "$scratch/prefix" -name 'libaxiscal*.a' | grep -q . && fail "static libraries are installed too"
exported=$(nm -DC --defined-only "$library" | sed 's/^[0-9a-f]* *//')
grep -q '^T axiscal::calibrate(' <<<"$exported" || fail "it does not export calibrate()"
# The names of Eigen, JSON and fmt are not exported. (nm's V, W and u are not looked at: every C++ library
# exports such names of the standard library.)
foreign=$(grep -E '^[TBDR] ' <<<"$exported" | grep -vE 'axiscal::|axiscal_' || true)
[ -z "$foreign" ] || fail "it exports $(head -n 5 <<<"$foreign")"
for tool in archive z sqlite3 matio ssl pango; do
  ! ldd "$library" | grep -q "lib$tool\\.so" || fail "it loads lib$tool"
done
readelf -d "$library" | grep -q 'RUNPATH.*\$ORIGIN/../lib' || fail "its RUNPATH does not contain \$ORIGIN/../lib"

cmake -S "$source/tests/install/consumer" -B "$scratch/by_package" "-DCMAKE_PREFIX_PATH=$scratch/prefix" >/dev/null
cmake --build "$scratch/by_package" >/dev/null
"$scratch/by_package/consumer" 30.0000
pc=$(find "$scratch/prefix" -name '*.pc')
[ "$(wc -l <<<"$pc")" -eq 1 ] || fail "more than one .pc: $pc"
export PKG_CONFIG_PATH="${pc%/*}"
[ "$(pkg-config --modversion axiscal)" = "$version" ] || fail "pkg-config states another version"
# shellcheck disable=SC2046
"${CXX:-g++}" -std=c++20 "$source/tests/install/consumer/main.cpp" -o "$scratch/by_pkg_config" \
  $(pkg-config --cflags --libs axiscal) "-Wl,-rpath,${library%/*}"
"$scratch/by_pkg_config" 30.0000
echo "shared: $(grep -cE '^T ' <<<"$exported") functions exported, $(stat -Lc %s "$library") bytes"
