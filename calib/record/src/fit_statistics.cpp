// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/fit_statistics.hpp"

#include <algorithm>

namespace axiscal {

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

const ScatterComponent* FitStatistics::find_component(std::string_view name) const {
  const auto found = std::find_if(components.begin(), components.end(),
                                  [name](const auto& one) { return one.name == name; });
  return found == components.end() ? nullptr : &*found;
}

}  // namespace axiscal
