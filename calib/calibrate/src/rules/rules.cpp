// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/method_kind.hpp"
#include "calib/calibrate/src/rules/rule.hpp"

namespace axiscal {
namespace {

std::vector<WarningRule>& all_rules() {
  static std::vector<WarningRule> rules = {
      mistake_rule(),
      uncertain_direction_rule(),
      two_solutions_rule(),
      one_sided_unsettled_rule(),
      gap_rule(),
      unseen_axes_rule(),
      levelness_rule(),
      outliers_rule(),
      uncertain_sensitivity_rule(),
      poor_fit_rule(),
      moved_table_rule(),
      axes_rule(),
      lack_of_fit_rule(),
      nonlinearity_rule(),
      slope_rule(),
      unpaired_rule(),
      field_magnitude_rule(),
      condition_rule(),
      no_redundancy_rule(),
      saturated_rule(),
  };
  return rules;
}

}  // namespace

std::span<const WarningRule> warning_rules() {
  return all_rules();
}

void add_warning_rule(const WarningRule& rule) {
  all_rules().push_back(rule);
}

std::vector<CalibrationWarning> find_warnings(const JudgedRun& run) {
  Warnings found;
  for (const WarningRule& rule : warning_rules()) {
    rule.find(run, found);
  }
  return std::move(found.all);
}

double full_response(const JudgedRun& run, Eigen::Index k) {
  return run.calibration.sensor.response.sensitivity.row(k).norm() *
         run.calibration.sensor.field.magnitude;
}

bool determines_main_sensitivity(const JudgedRun& run, Eigen::Index k) {
  const Eigen::Matrix3Xd& seen = run.estimate.sight.seen;
  const std::optional<int> nominal = nominal_axis(run.calibration.sensor.instrument, k);
  return seen.cols() == 0 || !nominal || seen.row(*nominal).norm() > 0.5;
}

bool by_magnitude(const JudgedRun& run) {
  return method_kind(run.calibration.fit.method).by_magnitude;
}

}  // namespace axiscal
