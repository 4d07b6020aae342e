// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "axiscal/core/boxed_optional.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The outputs of an instrument's temperature sensors during a reading. There is one number for all
/// axes or, if each axis has its own sensor, one number for each axis.
class AXISCAL_EXPORT SensorTemperature {
 public:
  /// One output for all axes. The constructor is not explicit, because most instruments have one
  /// sensor.
  SensorTemperature(double of_all = 0.0) : mean_(of_all) {}  // NOLINT(google-explicit-constructor)

  /// @param of_axes  m outputs, in the order of the axes.
  /// @throws DomainError  if `of_axes` is empty.
  explicit SensorTemperature(std::vector<double> of_axes);

  /// @return the output that applies to an axis.
  [[nodiscard]] double of(Eigen::Index axis) const {
    return of_axes_ ? (*of_axes_)[static_cast<std::size_t>(axis)] : mean_;
  }

  /// @return the mean over the axes, for uses that need one number.
  [[nodiscard]] double mean() const { return mean_; }

  /// @return true if each axis has a separate output.
  [[nodiscard]] bool has_own() const { return of_axes_.has_value(); }

  /// @return the output of each axis; empty if all axes share one output.
  [[nodiscard]] const std::vector<double>& of_axes() const;

  /// @return the outputs of `count` axes, beginning with axis `first`, for example those of one
  ///         instrument in an assembly. If they are equal, the result has one output for all axes.
  [[nodiscard]] SensorTemperature of_some(Eigen::Index first, Eigen::Index count) const;

  /// @return the outputs plus `difference`.
  [[nodiscard]] SensorTemperature changed_by(double difference) const;

  friend bool operator==(const SensorTemperature& a, const SensorTemperature& b) {
    return a.mean_ == b.mean_ && a.of_axes() == b.of_axes();
  }

 private:
  double mean_ = 0.0;
  BoxedOptional<std::vector<double>> of_axes_;
};

}  // namespace axiscal
