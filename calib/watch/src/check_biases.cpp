// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/drift_check.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the derivative of an axis's bias with respect to the parameters of the record, at a
// temperature that differs by d from the reference temperature.
Eigen::RowVectorXd change_of_bias(const Calibration& record, const std::string& axis, double d) {
  const FitStatistics& statistics = *record.fit.statistics;
  Eigen::RowVectorXd gradient = Eigen::RowVectorXd::Zero(statistics.covariance.cols());
  double power = 1.0;
  const Eigen::Index order = record.sensor.temperature ? record.sensor.temperature->bias.cols() : 0;
  for (Eigen::Index j = 0; j <= order; ++j) {
    const std::string name = j == 0   ? axis + ".bias"
                             : j == 1 ? axis + ".bias.d"
                                      : formatted("{}.bias.d{}", axis, j);
    if (const auto at = statistics.position_of(name)) {
      gradient(*at) = power;
    }
    power *= d;
  }
  return gradient;
}

void require_biases(const Calibration& record) {
  if (!record.fit.statistics || !record.fit.statistics->covariance.allFinite() ||
      record.fit.statistics->covariance.size() == 0) {
    throw DomainError(
        "a record lacks the covariance of its biases, so the biases cannot be compared");
  }
}

}  // namespace

DriftCheck check_biases(const Calibration& old,
                        const Calibration& fresh,
                        const std::optional<SensorTemperature>& temperature,
                        double alpha) {
  require_biases(old);
  require_biases(fresh);
  if (old.sensor.instrument.axes != fresh.sensor.instrument.axes) {
    throw DomainError("the axes of the two calibrations are not the same");
  }
  DriftCheck check{.alpha = alpha,
                   .pitch_error_deg = not_a_number,
                   .pitch_error_u_deg = not_a_number,
                   .pitch_error_expanded_deg = not_a_number};
  FisherSum axes;
  for (std::size_t k = 0; k < old.sensor.instrument.axes.size(); ++k) {
    const std::string& axis = old.sensor.instrument.axes[k];
    const auto row = static_cast<Eigen::Index>(k);
    const double d = old.sensor.temperature && temperature
                         ? temperature->of(row) - old.sensor.temperature->span_of(row).reference
                         : 0.0;
    VarianceShares shares;
    VarianceShares now;
    static_cast<void>(propagate(old, change_of_bias(old, axis, d), &shares));
    static_cast<void>(propagate(fresh, change_of_bias(fresh, axis, 0.0), &now));
    shares += now;
    const CombinedUncertainty u = combine(shares);
    const double shift = old.sensor.temperature && temperature
                             ? old.sensor.temperature->bias_shift(row, temperature->of(row))
                             : 0.0;
    ParameterChange change{.parameter = axis + ".bias",
                           .old_value = old.sensor.response.bias(row) + shift,
                           .new_value = fresh.sensor.response.bias(row) + shift,
                           .u = u.u,
                           .z = 0.0,
                           .e_n = not_a_number};
    const double difference = change.new_value - change.old_value;
    // If the readings have no noise, equal biases may still differ by rounding errors.
    const double rounding = 64.0 * std::numeric_limits<double>::epsilon() *
                            std::max(std::abs(change.new_value), std::abs(change.old_value));
    change.z = u.u > 0.0 && std::abs(difference) > rounding ? difference / u.u : 0.0;
    const double p = student_t_two_sided_p(change.z, u.degrees_of_freedom);
    axes.add(std::isnan(p) ? 1.0 : p);
    check.changes.push_back(std::move(change));
  }
  check.p_value = axes.p_value();
  check.drifted = check.p_value < alpha;
  check.notes.push_back(formatted(
      "the biases include the response to the field, so the comparison{} is valid only if the "
      "instrument was in the same pose as for the record",
      temperature ? formatted(" at temperature {}", number_text(temperature->mean(), 4)) : ""));
  return check;
}

}  // namespace axiscal
