// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/long_recording.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/jackknife.hpp"
#include "core/formatted.hpp"

namespace axiscal {

bool is_long_recording(Eigen::Index readings) {
  constexpr Eigen::Index fewest = 200;
  return readings >= fewest;
}

void add_long_correlation(const Eigen::VectorXd& uncertainties,
                          FitStatistics& statistics,
                          std::vector<CalibrationNote>& notes) {
  if (!uncertainties.allFinite()) {
    notes.push_back({NoteCode::correlation,
                     "some coefficients are determined by only one tenth of the recording, so "
                     "their intervals do not include the correlation of consecutive readings"});
    return;
  }
  constexpr auto degrees_of_freedom = static_cast<double>(jackknife_parts - 1);
  statistics.covariance = rescaled_covariance(statistics.covariance, uncertainties);
  const Eigen::Index m = statistics.residual_sd.size();
  const Eigen::Index p = statistics.covariance.rows() / m;
  ScatterComponent component{.name = "correlation",
                             .sd = uncertainties(Eigen::seqN(0, m, p)),
                             .unit = {},
                             .covariance = statistics.covariance,
                             .degrees_of_freedom = degrees_of_freedom};
  statistics.components.push_back(std::move(component));
  statistics.interval_dof.setConstant(statistics.covariance.rows(), degrees_of_freedom);
  put_intervals(statistics);
}

void add_correlation(const Eigen::VectorXd& uncertainties,
                     double degrees_of_freedom,
                     FitStatistics& statistics) {
  fill_intervals(statistics);
  const double t = student_t_factor(0.95, degrees_of_freedom);
  Eigen::VectorXd wider = statistics.covariance.diagonal().cwiseSqrt();
  Eigen::VectorXd intervals = statistics.interval_95;
  for (Eigen::Index i = 0; i < wider.size(); ++i) {
    wider(i) = std::max(wider(i), uncertainties(i));
    intervals(i) = std::max(intervals(i), t * uncertainties(i));
  }
  const Eigen::MatrixXd before = statistics.covariance;
  statistics.covariance = rescaled_covariance(before, wider);
  const Eigen::Index m = statistics.residual_sd.size();
  const Eigen::Index p = statistics.covariance.rows() / m;
  std::erase_if(statistics.components,
                [](const ScatterComponent& one) { return one.name == "correlation"; });
  statistics.components.push_back({.name = "correlation",
                                   .sd = wider(Eigen::seqN(0, m, p)),
                                   .unit = {},
                                   .covariance = statistics.covariance,
                                   .degrees_of_freedom = degrees_of_freedom});
  for (Eigen::Index i = 0; i < wider.size(); ++i) {
    if (wider(i) > 0.0) {
      statistics.interval_dof(i) = freedom_of_factor(intervals(i) / wider(i), 0.95);
    }
  }
  statistics.interval_95 = intervals;
}

std::vector<std::string> remarks_on_length(double independent) {
  constexpr double enough = 30.0;
  constexpr double fewest = 10.0;
  if (independent >= enough) {
    return {};
  }
  return {formatted(
      "the recording is short relative to the correlation of its noise: it is equivalent to about "
      "{} independent readings, and {}",
      number_text(std::round(independent)),
      independent < fewest ? "the stated uncertainties are lower bounds; record for longer"
                           : "the 95 % intervals contain the true value in only 83 to 92 % of "
                             "cases; record for longer")};
}

}  // namespace axiscal
