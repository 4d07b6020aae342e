// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/sensor_temperature.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "axiscal/core/error.hpp"

namespace axiscal {

SensorTemperature::SensorTemperature(std::vector<double> of_axes) {
  if (of_axes.empty()) {
    throw DomainError("SensorTemperature: at least one output is needed");
  }
  mean_ =
      std::accumulate(of_axes.begin(), of_axes.end(), 0.0) / static_cast<double>(of_axes.size());
  of_axes_ = std::move(of_axes);
}

const std::vector<double>& SensorTemperature::of_axes() const {
  static const std::vector<double> none;
  return of_axes_ ? *of_axes_ : none;
}

SensorTemperature SensorTemperature::of_some(Eigen::Index first, Eigen::Index count) const {
  if (!of_axes_) {
    return *this;
  }
  const auto from = of_axes_->begin() + first;
  const bool all_same = std::all_of(from, from + count, [&](double t) { return t == *from; });
  return all_same ? SensorTemperature(*from)
                  : SensorTemperature(std::vector<double>(from, from + count));
}

SensorTemperature SensorTemperature::changed_by(double difference) const {
  SensorTemperature changed = *this;
  changed.mean_ += difference;
  if (changed.of_axes_) {
    for (double& t : *changed.of_axes_) {
      t += difference;
    }
  }
  return changed;
}

}  // namespace axiscal
