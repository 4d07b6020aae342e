// SPDX-License-Identifier: Apache-2.0
#include "kernels/instruction_set.hpp"

#ifdef AXISCAL_HIGHWAY
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "instruction_set.cpp"
#include "kernels/src/vector_lanes.hpp"
// This file has no kernel; foreach_target.h only gives the list of targets.
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>
#include <hwy/targets.h>

#if HWY_ONCE
#include <atomic>
#include <cstdint>

namespace axiscal {
namespace {

// Highway's targets that this processor and operating system support.
std::int64_t supported_targets() {
  std::int64_t targets = HWY_STATIC_TARGET;
#if HWY_ARCH_X86 && (defined(__GNUC__) || defined(__clang__))
  const bool sse4 = __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("pclmul") &&
                    __builtin_cpu_supports("aes");
  const bool avx2 = sse4 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                    __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
  const bool avx3 = avx2 && __builtin_cpu_supports("avx512f") &&
                    __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
                    __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd");
  targets |= (sse4 ? HWY_SSE4 : 0) | (avx2 ? HWY_AVX2 : 0) | (avx3 ? HWY_AVX3 : 0);
#endif
  return targets & HWY_TARGETS;
}

// Returns the supported targets, best first. The best target has the lowest bit.
std::vector<std::int64_t> usable_targets() {
  std::vector<std::int64_t> targets;
  for (std::int64_t left = supported_targets(); left != 0; left &= left - 1) {
    targets.push_back(left & -left);
  }
  return targets;
}

std::size_t place_of(std::int64_t target) {
  constexpr int first = HWY_HIGHEST_TARGET_BIT + 1 - HWY_MAX_DYNAMIC_TARGETS;
  for (int place = 0; place < HWY_MAX_DYNAMIC_TARGETS; ++place) {
    if (target == std::int64_t{1} << (first + place)) {
      return static_cast<std::size_t>(place);
    }
  }
  return HWY_MAX_DYNAMIC_TARGETS;  // the index of the fallback in a kernel's table
}

std::atomic<std::int64_t>& chosen_target() {
  static std::atomic<std::int64_t> target = usable_targets().front();
  return target;
}

}  // namespace

std::size_t chosen_kernel() {
  return place_of(chosen_target().load(std::memory_order_relaxed));
}

std::vector<std::string> instruction_sets() {
  std::vector<std::string> names;
  for (const std::int64_t target : usable_targets()) {
    names.emplace_back(hwy::TargetName(target));
  }
  return names;
}

std::string instruction_set() {
  return hwy::TargetName(chosen_target());
}

bool use_instruction_set(std::string_view name) {
  for (const std::int64_t target : usable_targets()) {
    if (name.empty() || name == hwy::TargetName(target)) {
      chosen_target() = target;
      return true;
    }
  }
  return false;
}

}  // namespace axiscal
#endif
#else
namespace axiscal {

std::vector<std::string> instruction_sets() {
  return {"plain"};
}
std::string instruction_set() {
  return "plain";
}
bool use_instruction_set(std::string_view name) {
  return name.empty() || name == "plain";
}

}  // namespace axiscal
#endif
