// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Readings that are each the mean of one laying, with the scatter within the laying.
struct Layings {
  [[nodiscard]] const ReadingSet& set() const { return own ? *own : given; }

  const ReadingSet& given;             // must outlive it
  std::optional<ReadingSet> own;       // if their values differ
  Eigen::VectorXd squares;             // m: sums of squares within layings
  Eigen::VectorXd degrees_of_freedom;  // m
};

/// Readings that the estimate left unpaired do not count. Consecutive readings at one design point,
/// level and block are one laying. Over temperature each reading stands for itself.
[[nodiscard]] Layings layings_of(const ReadingSet& given, const Estimate& estimate);

}  // namespace axiscal
