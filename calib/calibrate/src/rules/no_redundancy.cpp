// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void find_no_redundancy(const JudgedRun& run, Warnings& found) {
  if (!(statistics_of(run).degrees_of_freedom.minCoeff() > 0.0)) {
    found.add(
        WarningCode::no_redundancy, {},
        "the number of readings equals the number of coefficients, so residuals, uncertainties "
        "and tests are impossible; take more design points");
  }
}

}  // namespace

WarningRule no_redundancy_rule() {
  return {.name = "no_redundancy", .find = find_no_redundancy};
}

}  // namespace axiscal
