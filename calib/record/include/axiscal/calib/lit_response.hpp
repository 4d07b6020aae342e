// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "axiscal/calib/sensor_model.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/table_field.hpp"

namespace axiscal {

/// Computes the reading of an instrument with one-sided axes under several light sources. An axis
/// does not respond to light from behind.
///
/// @param field  the field: one part, with its vector, for each light source.
/// @param level  the factors by which the stated parts are multiplied.
/// @param rotation_sensor_from_table  the orientation of the instrument.
/// @param temperature  output of the temperature sensors; nullopt: the reference temperature.
/// @return the reading, m entries [unit], without the responses to additional fields.
[[nodiscard]] AXISCAL_EXPORT Eigen::VectorXd light_response_at(
    const SensorModel& sensor,
    const TableField& field,
    const FieldLevel& level,
    const Eigen::Matrix3d& rotation_sensor_from_table,
    const std::optional<SensorTemperature>& temperature);

}  // namespace axiscal
