// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/temperature.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/field_description.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/instruments/instrument_kind.hpp"

namespace axiscal {

/// The response of an instrument to an additional field, for example of a gyroscope to gravity.
struct AXISCAL_EXPORT AlsoResponse {
  std::string kind;
  std::string unit;
  Eigen::Vector3d in_table = Eigen::Vector3d::Zero();  ///< stated vector in the table frame [unit]
  SensitivityMatrix sensitivity;                       ///< m x 3 [unit of the readings per `unit`]
  SensitivityMatrix sensitivity_se;                    ///< standard errors of sensitivity, m x 3
};

/// The model of a calibrated sensor with m axes. A reading in a field f is
///
///     v = bias(t) + scale(t) S f + the responses to additional fields
///
/// It is the part of a Calibration that reductions, simulations and exports need. A program can
/// fill it with data from another source.
///
/// @code
/// axiscal::SensorModel sensor;
/// sensor.instrument = axiscal::accelerometer("V");
/// sensor.response = {Eigen::Vector3d(0.1, -0.2, 0.3), 2.5 * Eigen::Matrix3d::Identity()};
/// const axiscal::Reducer reduce(sensor);
/// @endcode
///
/// @par Source
/// method.md, sections 2 and 6.
struct SensorModel {
  Instrument instrument;
  FieldDescription field;                          ///< reference field of the calibration
  LinearResponse response;                         ///< coefficients at the reference temperature
  std::optional<TemperatureResponse> temperature;  ///< nullopt without temperature terms
  std::vector<AlsoResponse> also;                  ///< response to each additional field
  /// The orientation of the sensor in the cube or assembly; nullopt if it is not stated.
  std::optional<Eigen::Matrix3d> rotation_sensor_from_assembly;
};

/// Predicts the reading of a sensor in a field.
///
/// @param field_in_sensor  f, the field vector [field unit].
/// @param temperature      output of the temperature sensors; nullopt: the reference temperature.
/// @return the reading v, m entries [unit], without the responses to additional fields.
[[nodiscard]] AXISCAL_EXPORT Eigen::VectorXd response_at(
    const SensorModel& sensor,
    const Eigen::Vector3d& field_in_sensor,
    const std::optional<SensorTemperature>& temperature);

/// Converts a reading to the value that it would have in the same field at the reference
/// temperature.
/// @param readings     v, m entries [unit].
/// @param temperature  temperature of the reading; nullopt: the reading is not changed.
[[nodiscard]] AXISCAL_EXPORT Eigen::VectorXd reading_at_reference(
    const SensorModel& sensor,
    Eigen::VectorXd readings,
    const std::optional<SensorTemperature>& temperature);

/// @param name  "x.bias", "x.sensitivity.y", "z.scale.d2", ...
/// @return the value of the parameter of that name.
/// @throws DomainError  if the sensor lacks that parameter.
[[nodiscard]] AXISCAL_EXPORT double parameter_value(const SensorModel& sensor,
                                                    const std::string& name);

/// @param covariance  covariance of bias and sensitivity, axis by axis, 4 m x 4 m; empty if
///                    unknown.
/// @return the coefficients, expressed as the quantities that are usual for this kind of
///         instrument, for example hard iron or responsivity.
[[nodiscard]] AXISCAL_EXPORT std::vector<KindQuantity> quantities_of(
    const SensorModel& sensor, const Eigen::MatrixXd& covariance = {});

}  // namespace axiscal
