// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/lit_response.hpp"

namespace axiscal {

Eigen::VectorXd light_response_at(const SensorModel& sensor,
                                  const TableField& field,
                                  const FieldLevel& level,
                                  const Eigen::Matrix3d& rotation_sensor_from_table,
                                  const std::optional<SensorTemperature>& temperature) {
  const Eigen::VectorXd dark = response_at(sensor, Eigen::Vector3d::Zero(), temperature);
  Eigen::VectorXd response = dark;
  for (std::size_t p = 0; p < field.parts().size(); ++p) {
    const Eigen::Vector3d light =
        rotation_sensor_from_table * (field.factor_of(p, level) * field.vector(p));
    response += (response_at(sensor, light, temperature) - dark).cwiseMax(0.0);
  }
  return response;
}

}  // namespace axiscal
