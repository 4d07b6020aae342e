// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Consecutive readings at one design point, level and block are one laying. With temperature
/// terms, or without design points, each reading is a laying of its own.
/// @return the position of the first reading of each laying.
[[nodiscard]] std::vector<std::size_t> laying_starts(const ReadingSet& set);

/// Readings that are each the mean of one laying, with the scatter within the laying.
struct Layings {
  [[nodiscard]] const ReadingSet& set() const { return own ? *own : given; }

  const ReadingSet& given;             // must outlive this object
  std::optional<ReadingSet> own;       // the means; nullopt: identical to `given`
  Eigen::VectorXd squares;             // m: sums of squares within layings
  Eigen::VectorXd degrees_of_freedom;  // m
};

/// Averages the readings of each laying. Readings in estimate.unpaired get the weight 0.
[[nodiscard]] Layings average_layings(const ReadingSet& given, const Estimate& estimate);

}  // namespace axiscal
