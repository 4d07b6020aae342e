// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/lit_response.hpp"

namespace axiscal {

Eigen::VectorXd lit_response_at(const SensorModel& sensor,
                                const Eigen::Matrix3Xd& lights_in_sensor,
                                std::optional<double> temperature) {
  const Eigen::VectorXd dark = response_at(sensor, Eigen::Vector3d::Zero(), temperature);
  Eigen::VectorXd response = dark;
  for (const auto& light : lights_in_sensor.colwise()) {
    response += (response_at(sensor, light, temperature) - dark).cwiseMax(0.0);
  }
  return response;
}

}  // namespace axiscal
