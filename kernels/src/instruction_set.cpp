// SPDX-License-Identifier: Apache-2.0
#include "axiscal/kernels/instruction_set.hpp"

#ifdef AXISCAL_HIGHWAY
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "instruction_set.cpp"
#include "vector_lanes.hpp"
// Only the list of targets is of interest here.
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>
#include <hwy/targets.h>

#if HWY_ONCE
namespace axiscal {

std::vector<std::string> instruction_sets() {
  std::vector<std::string> names;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    names.emplace_back(hwy::TargetName(target));
  }
  return names;
}

std::string instruction_set() {
  return instruction_sets().front();
}

bool use_instruction_set(std::string_view name) {
  hwy::SetSupportedTargetsForTest(0);
  std::int64_t mask = 0;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    if (name == hwy::TargetName(target)) {
      mask = target;
    }
  }
  hwy::SetSupportedTargetsForTest(mask);
  hwy::GetChosenTarget().Update(mask != 0 ? mask : hwy::SupportedTargets());
  return mask != 0 || name.empty();
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
