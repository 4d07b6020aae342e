// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "acquisition/src/axis_columns.hpp"

namespace axiscal {

/// Extracts the axes of a live instrument from the samples of its source, and detects invalid
/// values.
class AxisIntake {
 public:
  explicit AxisIntake(const Instrument& instrument);

  /// @throws DomainError  if no channel exists for an axis.
  void set_channels(const std::vector<Channel>& channels);

  /// Extracts the axes from a sample.
  /// @return false if the value of an axis is not finite.
  bool take(std::span<const double> values);

  /// @return the axes of the last sample, m entries [unit].
  [[nodiscard]] const Eigen::VectorXd& values() const { return values_; }

  /// @return true if an axis was at the limit of its range in at least three consecutive samples.
  [[nodiscard]] bool is_saturated() const { return !saturated_.empty(); }

  /// Messages about saturated axes, missing values and a wrong unit; empty without a problem.
  [[nodiscard]] std::string saturated_text() const;
  [[nodiscard]] std::string missing_text() const;
  [[nodiscard]] const std::string& unit_text() const { return unit_text_; }

 private:
  [[nodiscard]] bool is_beyond(double value) const;

  Instrument instrument_;
  std::vector<AxisColumns> columns_;
  std::string unit_text_;
  Eigen::VectorXd values_;
  // For each axis, the number of consecutive samples at or beyond the limit of its range.
  std::vector<std::size_t> beyond_;
  std::vector<std::string> saturated_;  // names of saturated axes
  std::vector<std::string> missing_;    // names of axes without a value in the last sample
};

}  // namespace axiscal
