# SPDX-License-Identifier: Apache-2.0
# The build scripts source this file. It sets one compiler process per core. Ninja's default is two processes more,
# which slow each other down on two cores.
export CMAKE_BUILD_PARALLEL_LEVEL="${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}"

# The default compiler is clang++: it compiles Eigen's expressions in 0.6 of g++'s time and memory (bench/README.md).
# CXX=g++ chooses g++. A build folder keeps the compiler of its first configuration. clang++ is not chosen if it is older
# than 14 or finds no standard library.
if [ -z "${CXX:-}" ] && printf '#include <span>\n#if __clang_major__ < 14\n#error\n#endif\n' |
  clang++ -std=c++20 -fsyntax-only -x c++ - 2>/dev/null; then
  export CXX=clang++
fi

# configure_dev [OPTIONS] configures the preset dev. Outside of CI, warnings are not errors, because a compiler that we
# have not tried may give new warnings.
configure_dev() {
  local strict=(-DCMAKE_COMPILE_WARNING_AS_ERROR=OFF)  # a cache variable, so that reconfiguration by ninja keeps it
  [ -z "${CI:-}" ] || strict=()
  cmake --preset dev "${strict[@]}" "$@"
}
