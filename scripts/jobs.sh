# SPDX-License-Identifier: Apache-2.0
# Sourced by the scripts that build: one compiler a core. Ninja's own choice is two more, and on two cores
# four compilers are in each other's way.
export CMAKE_BUILD_PARALLEL_LEVEL="${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}"

# Configures the tests' build: dev [OPTIONS]. A compiler that we have not seen may warn of something new;
# that is no failure of a user's build.
configure_dev() {
  local strict=(--compile-no-warning-as-error)
  [ -z "${CI:-}" ] || strict=()
  cmake --preset dev "${strict[@]}" "$@"
}
