// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <string>
#include <utility>

#include "mistake_kind.hpp"

namespace axiscal {
namespace {

constexpr std::array saturated_advice = {
    MistakeAdvice{.code = WarningCode::saturated,
                  .one = "State its range, or set the instrument to one that holds the field; a "
                         "curved response looks the "
                         "same."}};

void explain_by_saturation(const SuspectRun& run, Explanations& found) {
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    for (const bool top : {true, false}) {
      const std::vector<std::size_t> readings = run.extremes(k, top, run.plain());
      Correction correction = about(run, WarningCode::saturated, readings);
      found.add(run.saturated(k, top), {drift_range * run.full_response(k)},
                2.0 * static_cast<double>(run.m()), std::move(correction),
                std::string("with axis ") + run.set().axes[static_cast<std::size_t>(k)] +
                    (top ? " limited at its upper end" : " limited at its lower end"));
    }
  }
}

}  // namespace

MistakeKind saturated_kind() {
  return {.advice = saturated_advice, .of_run = explain_by_saturation};
}

}  // namespace axiscal
