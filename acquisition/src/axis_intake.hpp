// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "acquisition/src/axis_columns.hpp"

namespace axiscal {

/// The axes of a live instrument among the channels of its source, and their problems.
class AxisIntake {
 public:
  explicit AxisIntake(const Instrument& instrument);

  /// @throws DomainError  as find_axes().
  void set_channels(const std::vector<Channel>& channels);

  /// Takes the axes of a sample.
  /// @return false if a value is not a number.
  bool take(std::span<const double> values);

  /// @return m entries of the last sample.
  [[nodiscard]] const Eigen::VectorXd& values() const { return values_; }

  /// @return true if an axis was at the end of its range for some samples.
  [[nodiscard]] bool is_saturated() const { return !saturated_.empty(); }

  /// A message about saturation; empty without a problem.
  [[nodiscard]] std::string saturated_text() const;
  [[nodiscard]] std::string missing_text() const;
  [[nodiscard]] const std::string& unit_text() const { return unit_text_; }

 private:
  [[nodiscard]] bool is_beyond(double value) const;

  Instrument instrument_;
  std::vector<AxisColumns> columns_;
  std::string unit_text_;
  Eigen::VectorXd values_;
  std::vector<std::size_t>
      beyond_;  // number of consecutive samples beyond the range, for each axis
  std::vector<std::string> saturated_;  // axes
  std::vector<std::string> missing_;    // axes of the last sample
};

}  // namespace axiscal
