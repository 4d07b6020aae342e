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

/// The response of an instrument besides its field: a gyroscope's to gravity.
struct AXISCAL_EXPORT AlsoResponse {
  std::string kind;
  std::string unit;
  Eigen::Vector3d in_table = Eigen::Vector3d::Zero();  ///< as given [unit]
  SensitivityMatrix sensitivity;                       ///< m x 3 [unit of the readings per unit]
  SensitivityMatrix sensitivity_se;                    ///< its standard errors
};

/// A calibrated sensor: an instrument of m axes, and its readings in a field.
///
///     v = bias(t) + scale(t) S f + the responses to second fields
///
/// The part of a Calibration that reductions, simulations and exports need. They do not need its
/// origin. A program with another source of the sensor's data fills it in itself.
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
  FieldDescription field;   ///< in which it was calibrated, or is read
  LinearResponse response;  ///< the coefficients; over temperature at its reference
  std::optional<TemperatureResponse> temperature;  ///< if it was modelled
  std::vector<AlsoResponse> also;                  ///< one for each second field
  /// The orientation in the cube or assembly of the calibration, if it is stated.
  std::optional<Eigen::Matrix3d> rotation_sensor_from_assembly;
};

/// The reading that a sensor gives.
///
/// @param field_in_sensor  f [field unit].
/// @param temperature      what its temperature sensors say; without it the reference counts.
/// @return v, m entries [unit]; without second fields.
[[nodiscard]] AXISCAL_EXPORT Eigen::VectorXd response_at(
    const SensorModel& sensor,
    const Eigen::Vector3d& field_in_sensor,
    const std::optional<SensorTemperature>& temperature);

/// The inverse: the reading at the reference temperature.
/// @param readings     v, m entries [unit].
/// @param temperature  at which they were taken; without one, or without terms, they stay.
[[nodiscard]] AXISCAL_EXPORT Eigen::VectorXd reading_at_reference(
    const SensorModel& sensor,
    Eigen::VectorXd readings,
    const std::optional<SensorTemperature>& temperature);

/// @param name  "x.bias", "x.sensitivity.y", "z.scale.d2", ...
/// @throws DomainError  for a name that is none of the sensor's.
[[nodiscard]] AXISCAL_EXPORT double parameter_value(const SensorModel& sensor,
                                                    const std::string& name);

/// @param covariance  of bias and sensitivity, 4 for each axis, in the order of the axes; empty
///                    where it is not known.
/// @return the usual names of its coefficients for this kind of instrument: hard iron,
///         responsivity, ...
[[nodiscard]] AXISCAL_EXPORT std::vector<KindQuantity> quantities_of(
    const SensorModel& sensor, const Eigen::MatrixXd& covariance = {});

}  // namespace axiscal
