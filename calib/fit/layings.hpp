// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Consecutive readings at one design point, level and block are one laying. Over temperature, and
/// without design points, each reading stands for itself.
/// @return the position of the first reading of each laying.
[[nodiscard]] std::vector<std::size_t> laying_starts(const ReadingSet& set);

/// Readings that are each the mean of one laying, with the scatter within the laying.
struct Layings {
  [[nodiscard]] const ReadingSet& set() const { return own ? *own : given; }

  const ReadingSet& given;             // must outlive it
  std::optional<ReadingSet> own;       // if their values differ
  Eigen::VectorXd squares;             // m: sums of squares within layings
  Eigen::VectorXd degrees_of_freedom;  // m
};

/// Readings that the estimate left unpaired do not count.
[[nodiscard]] Layings average_layings(const ReadingSet& given, const Estimate& estimate);

}  // namespace axiscal
