// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "axiscal/calib/sensor_model.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/table_field.hpp"

namespace axiscal {

/// The reading of one-sided axes under several lights. An axis does not respond to light from
/// behind.
///
/// @param field  the lights: one part of the field, with its vector, for each light.
/// @param level  the level of the lights.
/// @param rotation_sensor_from_table  the orientation of the instrument.
/// @param temperature  output of the temperature sensors; nullopt: the reference temperature.
/// @return v, m entries [unit]; it does not include the responses to second fields.
[[nodiscard]] AXISCAL_EXPORT Eigen::VectorXd light_response_at(
    const SensorModel& sensor,
    const TableField& field,
    const FieldLevel& level,
    const Eigen::Matrix3d& rotation_sensor_from_table,
    const std::optional<SensorTemperature>& temperature);

}  // namespace axiscal
