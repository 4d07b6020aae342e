// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Warns of axes whose sensitivity to their nominal component is not determined. With a partial
// design, only the cross-axis sensitivities of an axis may be determined.
void find_unseen_axes(const JudgedRun& run, Warnings& found) {
  std::vector<std::string> names;
  for (Eigen::Index k = 0; k < run.calibration.sensor.response.bias.size(); ++k) {
    if (!determines_main_sensitivity(run, k)) {
      names.push_back(axis_name(run, k));
    }
  }
  if (!names.empty()) {
    found.add(WarningCode::coverage, {},
              formatted("in these readings, the field has no component along {} {}, so the "
                        "sensitivity in this direction is not determined; add readings with the "
                        "instrument turned about another axis",
                        names.size() == 1 ? "axis" : "the axes", joined(names)));
  }
}

}  // namespace

WarningRule unseen_axes_rule() {
  return {.name = "unseen_axes", .find = find_unseen_axes};
}

}  // namespace axiscal
