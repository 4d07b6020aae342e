// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/temperature_choice.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/temperature.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/calibrate/src/method_choice.hpp"
#include "calib/fit/temperature_fit.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

bool nothing_is_said(const TemperatureSetup& setup) {
  return setup.order == 0 && !setup.automatic && !setup.ignored;
}

// Returns the temperatures of the readings that are not left out. The list is empty if one of these
// readings has no temperature.
std::vector<double> temperatures_of(const std::vector<Reading>& readings,
                                    const std::vector<int>& left_out) {
  std::vector<double> temperatures;
  for (const Reading& reading : readings) {
    if (std::find(left_out.begin(), left_out.end(), reading.run) != left_out.end()) {
      continue;
    }
    if (!reading.temperature) {
      return {};
    }
    temperatures.push_back(reading.temperature->mean());
  }
  return temperatures;
}

// Tests whether the residuals are correlated with the temperature. Returns the smallest p-value of
// the axes, with Bonferroni's correction.
double p_of_following(const ReadingSet& set,
                      const TableField& field,
                      const std::vector<double>& temperatures) {
  const Eigen::MatrixXd base = field_design(set, field);
  double smallest = 1.0;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const Eigen::VectorXd root = set.weights.col(k).cwiseSqrt();
    const Eigen::MatrixXd X = root.asDiagonal() * set.all_columns(base, k);
    const Eigen::VectorXd t = Eigen::Map<const Eigen::VectorXd>(
        temperatures.data(), static_cast<Eigen::Index>(temperatures.size()));
    const auto [inverse, rank] = pseudo_inverse_with_rank(X);
    const Eigen::VectorXd centred = root.asDiagonal() * (t.array() - t.mean()).matrix();
    const Eigen::VectorXd d = centred - X * (inverse * centred);
    const Eigen::VectorXd y = root.asDiagonal() * set.response.col(k);
    const Eigen::VectorXd r = y - X * (inverse * y);
    const double free = static_cast<double>((root.array() > 0.0).count() - rank) - 1.0;
    // The test uses only the component of the temperature that is orthogonal to the columns of the
    // fit. If this component is negligible (squared norm below `independent` times that of the
    // temperature), the temperature is a function of the poses, and the axis is not tested.
    constexpr double independent = 1e-6;
    if (!(free >= 1.0) || !(d.squaredNorm() > independent * centred.squaredNorm())) {
      continue;
    }
    const double drop = std::pow(d.dot(r), 2) / d.squaredNorm();
    const double left = r.squaredNorm() - drop;
    if (left > 0.0 && r.cwiseAbs().maxCoeff() > set.rounding(k)) {
      smallest = std::min(smallest, f_upper_p(drop / (left / free), 1.0, free));
    }
  }
  return std::min(1.0, static_cast<double>(set.axis_count()) * smallest);
}

}  // namespace

bool has_temperatures_enough(const Experiment& experiment, const Observations& observations) {
  if (!nothing_is_said(experiment.fit.temperature) || experiment.instrument.one_sided ||
      (!has_labels(observations) && !has_stated_fields(observations)) ||
      !method_kind(experiment.fit.method.value_or(Method::joint)).by_pose) {
    return false;
  }
  const std::vector<double> temperatures =
      temperatures_of(observations.readings, experiment.leave_out);
  constexpr std::size_t fewest_continuous = 24;
  const std::set<double> different(temperatures.begin(), temperatures.end());
  if (different.size() < 2) {
    return false;
  }
  const std::vector<int> soaks = soak_levels(temperatures);
  return soaks.empty() ? temperatures.size() >= fewest_continuous
                       : *std::max_element(soaks.begin(), soaks.end()) > 0;
}

bool clearly_needed(const std::vector<TemperatureOrderTrial>& trials) {
  // If the temperature has no effect, order 1 (two more terms for each of three axes) lowers
  // Akaike's information criterion AICc by more than this limit in only 0.1 % of the runs.
  constexpr double clear_gain = 10.0;
  return !trials.empty() &&
         std::any_of(trials.begin(), trials.end(), [&](const TemperatureOrderTrial& trial) {
           return trial.aicc < trials.front().aicc - clear_gain;
         });
}

void warn_of_ignored_temperature(const Experiment& experiment,
                                 const ReadingSet& set,
                                 const TableField& field,
                                 Calibration& calibration) {
  const std::vector<double> temperatures = temperatures_of(set.readings, {});
  if (!nothing_is_said(experiment.fit.temperature) || temperatures.empty()) {
    return;
  }
  const auto [low, high] = std::minmax_element(temperatures.begin(), temperatures.end());
  // Limits in degrees C. If a temperature is outside `coldest` to `hottest`, it is probably in
  // another unit, so the span is not tested.
  constexpr double much = 5.0;
  constexpr double coldest = -100.0;
  constexpr double hottest = 200.0;
  const bool spans_much = *high - *low >= much && *low >= coldest && *high <= hottest;
  const bool by_magnitude = method_kind(calibration.fit.method).by_magnitude;
  constexpr double false_alarm = 0.002;
  const double p = by_magnitude || *high == *low ? 1.0 : p_of_following(set, field, temperatures);
  if (!spans_much && !(p < false_alarm)) {
    return;
  }
  calibration.findings.warnings.push_back(
      {.code = WarningCode::temperature,
       .runs = {},
       .message = formatted(
           "the values in the column 'temperature' range from {} to {}, but the fit lacks "
           "temperature terms{}; {}. To ignore the temperatures, set the temperature order to 0",
           number_text(*low, 4), number_text(*high, 4),
           p < false_alarm
               ? formatted(": the residuals follow the temperature (p = {})", number_text(p, 2))
               : "",
           by_magnitude ? "the method 'magnitude' cannot fit such terms: calibrate each "
                          "temperature separately"
                        : "repeat the whole design at two or more temperatures, or take at least "
                          "24 readings at various temperatures")});
}

}  // namespace axiscal
