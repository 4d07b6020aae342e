// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/sensor_model.hpp"

#include <string_view>
#include <vector>

#include "axiscal/core/error.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {

Eigen::VectorXd response_at(const SensorModel& sensor,
                            const Eigen::Vector3d& field_in_sensor,
                            const std::optional<SensorTemperature>& temperature) {
  Eigen::VectorXd response = sensor.response.at(field_in_sensor);
  for (Eigen::Index k = 0; sensor.temperature && temperature && k < response.size(); ++k) {
    const double bias = sensor.response.bias(k);
    const double t = temperature->of(k);
    response(k) = bias + sensor.temperature->bias_shift(k, t) +
                  sensor.temperature->scale_at(k, t) * (response(k) - bias);
  }
  return response;
}

Eigen::VectorXd reading_at_reference(const SensorModel& sensor,
                                     Eigen::VectorXd readings,
                                     const std::optional<SensorTemperature>& temperature) {
  for (Eigen::Index k = 0; sensor.temperature && temperature && k < readings.size(); ++k) {
    const double bias = sensor.response.bias(k);
    readings(k) =
        bias + sensor.temperature->bias_corrected(k, readings(k), bias, temperature->of(k));
  }
  return readings;
}

double parameter_value(const SensorModel& sensor, const std::string& name) {
  for (std::size_t k = 0; k < sensor.instrument.axes.size(); ++k) {
    const std::string& axis = sensor.instrument.axes[k];
    if (name.size() <= axis.size() || !name.starts_with(axis) || name[axis.size()] != '.') {
      continue;
    }
    const auto row = static_cast<Eigen::Index>(k);
    const std::string_view what = std::string_view(name).substr(axis.size() + 1);
    if (what == "bias") {
      return sensor.response.bias(row);
    }
    const std::size_t component =
        what.empty() ? std::string::npos : std::string_view("xyz").find(what.back());
    if (what.starts_with("sensitivity.") && what.size() == 13 && component != std::string::npos) {
      return sensor.response.sensitivity(row, static_cast<Eigen::Index>(component));
    }
    for (const AlsoResponse& also : sensor.also) {
      if (what.starts_with(also.kind) && what.substr(also.kind.size()).starts_with('.') &&
          component != std::string::npos) {
        return also.sensitivity(row, static_cast<Eigen::Index>(component));
      }
    }
    if (sensor.temperature && (what.starts_with("bias.d") || what.starts_with("scale.d"))) {
      const std::string digits(what.substr(what.find(".d") + 2));
      const std::optional<int> power = digits.empty() ? std::optional(1) : parse_integer(digits);
      const Eigen::MatrixXd& terms =
          what.front() == 'b' ? sensor.temperature->bias : sensor.temperature->scale;
      if (power && *power >= 1 && *power <= terms.cols()) {
        return terms(row, *power - 1);
      }
    }
  }
  std::vector<std::string> names;
  for (const std::string& axis : sensor.instrument.axes) {
    for (const char* const of : {".bias", ".sensitivity.x", ".sensitivity.y", ".sensitivity.z"}) {
      names.push_back(axis + of);
    }
  }
  throw DomainError(
      formatted("'{}' is not a parameter of this record{}", name,
                did_you_mean(name, std::vector<std::string_view>(names.begin(), names.end()))));
}

std::vector<KindQuantity> quantities_of(const SensorModel& sensor,
                                        const Eigen::MatrixXd& covariance) {
  const InstrumentKind& kind = find_instrument_kind(sensor.instrument.kind);
  if (kind.describe == nullptr) {
    return {};
  }
  const FieldDescription& field = sensor.field;
  return kind.describe({.instrument = sensor.instrument,
                        .response = sensor.response,
                        .covariance = covariance,
                        .field_kind = field.kind,
                        .field_unit = field.unit,
                        .magnitude = field.magnitude,
                        .in_table = field.in_table,
                        .in_table_covariance = field.in_table_covariance});
}

}  // namespace axiscal
