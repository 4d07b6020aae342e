// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <utility>
#include <vector>

#include "mistake_kind.hpp"

namespace axiscal {
namespace {

constexpr std::array drift_advice = {
    MistakeAdvice{.code = WarningCode::drift,
                  .one = "Let the instrument warm up, and take the readings in random order."}};

void explain_by_drift(const SuspectRun& run, Explanations& found) {
  std::vector<double> ranges;
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    ranges.push_back(drift_range * run.full_response(k));
  }
  found.add(run.drifted(), ranges, 1.0, Correction{.code = WarningCode::drift},
            "with a drift of the bias over the run");
}

}  // namespace

MistakeKind drift_kind() {
  return {.advice = drift_advice, .of_run = explain_by_drift};
}

}  // namespace axiscal
