# SPDX-License-Identifier: Apache-2.0
# Sourced by the scripts that build: one compiler a core. Ninja's own choice is two more, and on two cores
# four compilers are in each other's way.
export CMAKE_BUILD_PARALLEL_LEVEL="${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}"

# clang++ compiles Eigen's expressions in 0.6 of g++'s time and memory (bench/README.md). CXX=g++ asks for the other;
# a folder that is configured keeps its compiler. A clang++ that is too old, or finds no standard library, is not taken.
if [ -z "${CXX:-}" ] && printf '#include <span>\n#if __clang_major__ < 14\n#error\n#endif\n' |
  clang++ -std=c++20 -fsyntax-only -x c++ - 2>/dev/null; then
  export CXX=clang++
fi

# Configures the tests' build: dev [OPTIONS]. A compiler that we have not seen may warn of something new;
# that is no failure of a user's build.
configure_dev() {
  local strict=(-DCMAKE_COMPILE_WARNING_AS_ERROR=OFF)  # in the cache: ninja's own configuring keeps it
  [ -z "${CI:-}" ] || strict=()
  cmake --preset dev "${strict[@]}" "$@"
}
