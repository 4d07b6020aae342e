// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibration.hpp"

#include <algorithm>

#include "axiscal/calib/parameter_names.hpp"

namespace axiscal {
namespace {

// Of bias and sensitivity alone, 4 for each axis.
Eigen::MatrixXd covariance_of(const Calibration& calibration) {
  if (!calibration.statistics) {
    return {};
  }
  std::vector<Eigen::Index> kept;
  for (const std::string& axis : calibration.instrument.axes) {
    for (const std::string& name : parameter_names({axis})) {
      const std::optional<Eigen::Index> at = calibration.statistics->position_of(name);
      if (!at) {
        return {};
      }
      kept.push_back(*at);
    }
  }
  return calibration.statistics->covariance(kept, kept);
}

}  // namespace

Eigen::MatrixXd FitStatistics::covariance_of_readings() const {
  Eigen::MatrixXd of_readings = covariance;
  for (const ScatterComponent& component : components) {
    of_readings -= component.covariance;
  }
  return of_readings;
}

std::optional<Eigen::Index> FitStatistics::position_of(std::string_view parameter) const {
  const auto found = std::find(parameter_names.begin(), parameter_names.end(), parameter);
  if (found == parameter_names.end()) {
    return std::nullopt;
  }
  return found - parameter_names.begin();
}

Eigen::VectorXd response_at(const Calibration& calibration,
                            const Eigen::Vector3d& field_in_sensor,
                            std::optional<double> temperature) {
  Eigen::VectorXd response = calibration.response.at(field_in_sensor);
  for (Eigen::Index k = 0; calibration.temperature && temperature && k < response.size(); ++k) {
    const double bias = calibration.response.bias(k);
    response(k) = bias + calibration.temperature->bias_shift(k, *temperature) +
                  calibration.temperature->scale_at(k, *temperature) * (response(k) - bias);
  }
  return response;
}

Eigen::VectorXd reading_at_reference(const Calibration& calibration,
                                     Eigen::VectorXd readings,
                                     std::optional<double> temperature) {
  for (Eigen::Index k = 0; calibration.temperature && temperature && k < readings.size(); ++k) {
    const double bias = calibration.response.bias(k);
    readings(k) = bias + calibration.temperature->above_bias(k, readings(k), bias, *temperature);
  }
  return readings;
}

bool gives_field(const Calibration& calibration) {
  // Sensitivities are among its parameters only where another record gave them.
  return calibration.method != Method::bias ||
         (calibration.statistics && calibration.statistics->position_of(
                                        calibration.instrument.axes.front() + ".sensitivity.x"));
}

bool is_made_from(const Calibration& calibration, const std::vector<InputFileDigest>& inputs) {
  const std::vector<InputFileDigest>& own = calibration.inputs;
  return std::any_of(own.begin(), own.end(), [&](const InputFileDigest& one) {
    return !one.sha256.empty() &&
           std::any_of(inputs.begin(), inputs.end(),
                       [&](const InputFileDigest& other) { return other.sha256 == one.sha256; });
  });
}

std::vector<KindQuantity> quantities_of(const Calibration& calibration) {
  const InstrumentKind& kind = find_instrument_kind(calibration.instrument.kind);
  if (kind.describe == nullptr) {
    return {};
  }
  const FieldDescription& field = calibration.field;
  return kind.describe({.instrument = calibration.instrument,
                        .response = calibration.response,
                        .covariance = covariance_of(calibration),
                        .field_kind = field.kind,
                        .field_unit = field.unit,
                        .magnitude = field.magnitude,
                        .in_table = field.in_table,
                        .in_table_covariance = field.in_table_covariance});
}

}  // namespace axiscal
