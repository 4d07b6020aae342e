// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/temperature_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/record/parameter_names.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void require_temperatures(const ReadingSet& set) {
  const int order = set.temperature.order;
  const int count = temperature_count(set);
  if (count > order) {
    return;
  }
  std::vector<std::string> names;
  for (const std::string& axis : set.axes) {
    for (int j = std::max(count, 1); j <= order; ++j) {
      names.push_back(formatted("{}.bias{}", axis, power_suffix(j)));
      names.push_back(formatted("{}.scale{}", axis, power_suffix(j)));
    }
  }
  const std::string list = joined(names);
  throw RankDeficientError(
      formatted("readings at {}{} do not determine {}; temperature order {} needs {} temperatures: "
                "add readings at another temperature, or use temperature order {}",
                count, count == 1 ? " temperature" : " temperatures", list, order, order + 1,
                count - 1),
      std::move(names), {settings::temperature_order});
}

// Throws if the readings do not determine the temperature terms. At each temperature, readings with
// both signs of the field along each axis are needed.
void require_terms(const ReadingSet& set, const Estimate& estimate) {
  if (!estimate.field.has_vectors()) {
    return;  // the regression itself throws if coefficients are undetermined
  }
  const Eigen::MatrixXd base = field_design(set, estimate.field);
  std::vector<std::string> names;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const std::vector<std::string> all = set.names_of_axis(k);
    for (const Eigen::Index column : undetermined_columns(set.all_columns(base, k))) {
      names.push_back(all[static_cast<std::size_t>(column)]);
    }
  }
  if (!names.empty()) {
    const std::string list = joined(names);
    throw RankDeficientError(formatted("the readings do not determine {}; at each temperature, "
                                       "take readings with each axis up and down",
                                       list),
                             std::move(names));
  }
}

}  // namespace

int temperature_count(const ReadingSet& set) {
  const TemperatureTerms& terms = set.temperature;
  if (!terms.soak.empty()) {
    return 1 + *std::max_element(terms.soak.begin(), terms.soak.end());
  }
  const Eigen::VectorXd mean = terms.d.rowwise().mean();
  return static_cast<int>(std::set<double>(mean.begin(), mean.end()).size());
}

ReadingSet initialize_temperature_terms(const ReadingSet& set, const Estimate& without) {
  require_temperatures(set);
  ReadingSet started = set;
  started.temperature.scale = Eigen::MatrixXd::Zero(set.axis_count(), set.temperature.order);
  started.temperature.along = without.response.sensitivity;
  require_terms(started, without);
  return started;
}

double axis_aicc(double residual_sd, double degrees_of_freedom, double columns) {
  const double n = degrees_of_freedom + columns;
  const double parameters = columns + 1.0;  // the coefficients and the standard deviation
  if (!(n - parameters - 1.0 > 0.0)) {
    return std::numeric_limits<double>::infinity();
  }
  return n * std::log(residual_sd * residual_sd * degrees_of_freedom / n) +
         2.0 * parameters * n / (n - parameters - 1.0);
}

TemperatureOrderTrial trial_of(const ReadingSet& set, const Estimate& estimate) {
  const FitStatistics& statistics = estimate.statistics;
  TemperatureOrderTrial trial{.order = set.temperature.order, .lack_of_fit_p_value = not_a_number};
  const auto columns = static_cast<double>(set.column_count());
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    trial.aicc += axis_aicc(std::max(statistics.residual_sd(k), set.rounding(k)),
                            statistics.degrees_of_freedom(k), columns);
  }
  for (const LackOfFit& test : statistics.lack_of_fit) {
    trial.lack_of_fit_p_value = std::fmin(trial.lack_of_fit_p_value, test.p_value);
  }
  return trial;
}

int chosen_order(const std::vector<TemperatureOrderTrial>& trials) {
  constexpr double misfit_below = 0.001;
  std::size_t best = 0;
  for (std::size_t i = 1; i < trials.size(); ++i) {
    if (trials[i].aicc < trials[best].aicc) {
      best = i;
    }
  }
  while (best + 1 < trials.size() && trials[best].lack_of_fit_p_value < misfit_below &&
         trials[best + 1].lack_of_fit_p_value >= misfit_below) {
    ++best;
  }
  return trials[best].order;
}

}  // namespace axiscal
