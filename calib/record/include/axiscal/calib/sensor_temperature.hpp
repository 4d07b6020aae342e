// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "axiscal/core/boxed_optional.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The outputs of an instrument's temperature sensors at a reading: one number for all axes, or one
/// number for each axis if each has a sensor.
class AXISCAL_EXPORT SensorTemperature {
 public:
  /// One output for all axes. Not explicit, as most instruments have one sensor.
  SensorTemperature(double of_all = 0.0) : mean_(of_all) {}  // NOLINT(google-explicit-constructor)

  /// @param of_axes  m outputs, in the order of the axes.
  /// @throws DomainError  if there are none.
  explicit SensorTemperature(std::vector<double> of_axes);

  /// @return the output that counts for an axis.
  [[nodiscard]] double of(Eigen::Index axis) const {
    return of_axes_ ? (*of_axes_)[static_cast<std::size_t>(axis)] : mean_;
  }

  /// @return the mean over the axes, for uses that need one number.
  [[nodiscard]] double mean() const { return mean_; }

  /// @return true if each axis has a separate output.
  [[nodiscard]] bool has_own() const { return of_axes_.has_value(); }

  /// @return each axis's output; empty where one counts for all.
  [[nodiscard]] const std::vector<double>& of_axes() const;

  /// @return the outputs of neighbouring axes, as those of one instrument among several; one
  ///         number where they are all the same.
  [[nodiscard]] SensorTemperature of_some(Eigen::Index first, Eigen::Index count) const;

  /// @return all of them changed by as much.
  [[nodiscard]] SensorTemperature changed_by(double difference) const;

  friend bool operator==(const SensorTemperature& a, const SensorTemperature& b) {
    return a.mean_ == b.mean_ && a.of_axes() == b.of_axes();
  }

 private:
  double mean_ = 0.0;
  BoxedOptional<std::vector<double>> of_axes_;
};

}  // namespace axiscal
