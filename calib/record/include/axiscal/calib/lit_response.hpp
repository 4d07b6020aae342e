// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "axiscal/calib/sensor_model.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/table_field.hpp"

namespace axiscal {

/// The reading that one-sided axes give under the lights of a field: they read nothing from behind.
///
/// @param field  with its vectors; each of its parts is a light.
/// @param level  at which they are set.
/// @param rotation_sensor_from_table  how the instrument lies.
/// @param temperature  of the sensor; without one the reference counts.
/// @return v, m entries [unit]; without second fields.
[[nodiscard]] AXISCAL_EXPORT Eigen::VectorXd lit_response_at(
    const SensorModel& sensor,
    const TableField& field,
    const FieldLevel& level,
    const Eigen::Matrix3d& rotation_sensor_from_table,
    const std::optional<SensorTemperature>& temperature);

}  // namespace axiscal
