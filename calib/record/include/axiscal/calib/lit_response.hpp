// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "axiscal/calib/sensor_model.hpp"

namespace axiscal {

/// The reading that one-sided axes give under several lights: they read nothing from behind.
///
/// @param lights_in_sensor  one for each that shines, 3 x p [field unit].
[[nodiscard]] Eigen::VectorXd lit_response_at(const SensorModel& sensor,
                                              const Eigen::Matrix3Xd& lights_in_sensor,
                                              std::optional<double> temperature);

}  // namespace axiscal
