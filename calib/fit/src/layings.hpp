// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/calib/reading_set.hpp"

namespace axiscal {

/// Readings of which each is the mean of one laying, with what the laying's own scatter says.
struct Layings {
  ReadingSet set;
  Eigen::VectorXd squares;             // m: sums of squares within layings
  Eigen::VectorXd degrees_of_freedom;  // m
};

/// Consecutive readings at one design point, level and block are one laying. Over temperature each
/// reading stands for itself.
[[nodiscard]] Layings layings_of(const ReadingSet& set);

}  // namespace axiscal
