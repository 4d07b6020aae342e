// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/rules/rule.hpp"
#include "calib/record/calibration_warning.hpp"
#include "calib/regression/heavy_tails.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Permitted probability of a false alarm in a run with normal noise.
constexpr double false_outlier = 1e-4;
// Permitted probability of a false alarm in a run whose noise has heavy tails. The distribution of
// the noise is estimated from the residuals of the run.
constexpr double false_by_its_company = 0.01;

struct Outlier {
  const RegressionRow* row = nullptr;
  Eigen::Index axis = 0;
  double deviation = 0.0;  // absolute value of the externally studentised residual
};

std::vector<Outlier> find_outliers(const Calibration& calibration) {
  const FitStatistics& statistics = *calibration.fit.statistics;
  const auto tests = static_cast<double>(statistics.rows.size()) *
                     static_cast<double>(calibration.sensor.response.bias.size());
  std::vector<Outlier> outliers;
  std::optional<NoiseTails> tails;  // distribution of the residuals; computed at the first use
  const auto by_its_company = [&](double t) {
    if (!tails) {
      tails.emplace();
      for (const auto& row : statistics.studentized.rowwise()) {
        for (const double one : row) {
          if (std::isfinite(one)) {
            tails->add(one);
          }
        }
      }
    }
    tails->remove(t);
    const double p = tails->two_sided_p(t);
    tails->add(t);
    return p;
  };
  for (Eigen::Index i = 0; i < statistics.studentized.rows(); ++i) {
    for (Eigen::Index k = 0; k < statistics.studentized.cols(); ++k) {
      const double t = statistics.studentized(i, k);
      if (!(std::abs(t) > 3.0)) {
        continue;  // too small for an outlier
      }
      const double p = student_t_two_sided_p(t, statistics.degrees_of_freedom(k) - 1.0);
      const double full_response = calibration.sensor.response.sensitivity.row(k).norm() *
                                   calibration.sensor.field.magnitude;
      const bool rounding = statistics.residual_sd(k) <= 1e-13 * full_response;
      const bool has_no_weight =
          statistics.robust_weight.size() > 0 && statistics.robust_weight(i, k) == 0.0;
      if (p * tests < false_outlier && !rounding && !has_no_weight &&
          by_its_company(t) * tests < false_by_its_company) {
        outliers.push_back({.row = &statistics.rows[static_cast<std::size_t>(i)],
                            .axis = k,
                            .deviation = std::abs(t)});
        break;
      }
    }
  }
  return outliers;
}

// Returns a warning that names the outliers; nullopt if there are none. Fits by method `paired` are
// not tested: they use averages of readings, and these have too few degrees of freedom to identify
// a wrong reading. The levelness test looks for mistakes in such fits.
std::optional<CalibrationWarning> warning_of_outliers(const Calibration& calibration) {
  std::vector<Outlier> outliers;
  if (!method_kind(calibration.fit.method).averages_pairs) {
    outliers = find_outliers(calibration);
  }
  if (outliers.empty()) {
    return std::nullopt;
  }
  constexpr std::size_t most_named = 5;
  const std::size_t named = std::min(most_named, outliers.size());
  std::vector<int> runs;
  for (const Outlier& outlier : outliers) {
    runs.insert(runs.end(), outlier.row->runs.begin(), outlier.row->runs.end());
  }
  std::partial_sort(outliers.begin(), outliers.begin() + static_cast<std::ptrdiff_t>(named),
                    outliers.end(),
                    [](const Outlier& a, const Outlier& b) { return a.deviation > b.deviation; });
  const bool by_magnitude = method_kind(calibration.fit.method).by_magnitude;
  std::vector<std::string> worst;
  for (std::size_t i = 0; i < named; ++i) {
    const std::string& axis =
        calibration.sensor.instrument.axes[static_cast<std::size_t>(outliers[i].axis)];
    worst.push_back(formatted(
        "{}: {} deviates by {} standard deviations", name_of_runs(outliers[i].row->runs),
        by_magnitude ? "its magnitude" : "axis " + axis, number_text(outliers[i].deviation, 3)));
  }
  const std::string more =
      outliers.size() > named
          ? formatted(" (all {} such readings are marked in the record's rows)", outliers.size())
          : "";
  const char* const them = outliers.size() == 1 ? "this reading" : "these readings";
  return CalibrationWarning{
      .code = WarningCode::outlier,
      .runs = std::move(runs),
      .message = formatted("{} from the value that the other readings predict{}; {} take {} again, "
                           "or leave {} out",
                           joined(worst, "; "), more,
                           by_magnitude ? "if the instrument was moved," : "check the pose and",
                           them, them)};
}

void find_outliers(const JudgedRun& run, Warnings& found) {
  if (run.searched || run.mistakes.culprit) {
    return;  // the search for mistakes has already tested each reading
  }
  if (std::optional<CalibrationWarning> outliers = warning_of_outliers(run.calibration)) {
    found.all.push_back(std::move(*outliers));
  }
}

}  // namespace

WarningRule outliers_rule() {
  return {.name = "outliers", .find = find_outliers};
}

}  // namespace axiscal
