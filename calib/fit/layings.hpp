// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// The note of a calibration in which only the means of the layings are independent.
inline constexpr const char* note_of_layings =
    "consecutive readings of a pose share an error. The intervals therefore count them as one";

/// Divides the readings into layings. A laying is one placement of the cube: consecutive readings
/// at the same design point, field level and block. With temperature terms, or without design
/// points, each reading is a laying by itself.
/// @return the index of the first reading of each laying.
[[nodiscard]] std::vector<std::size_t> laying_starts(const ReadingSet& set);

/// The means over groups of readings, and the scatter within the groups.
struct MeanReadings {
  [[nodiscard]] const ReadingSet& set() const { return own ? *own : given; }

  void forget_scatter() {
    squares.setZero();
    degrees_of_freedom.setZero();
  }

  const ReadingSet& given;             // the original readings; must outlive this object
  std::optional<ReadingSet> own;       // the means; nullopt if they are identical to `given`
  Eigen::VectorXd squares;             // m: sum of squares about the means of the groups
  Eigen::VectorXd degrees_of_freedom;  // m: degrees of freedom of `squares`
};

/// Averages the readings of each laying. Readings in estimate.unpaired get the weight 0.
[[nodiscard]] MeanReadings average_layings(const ReadingSet& given, const Estimate& estimate);

/// Averages the readings of each pose over the blocks, after subtracting the fitted effects of the
/// run (estimate.effects). The means contain no such effects. If no pose was repeated, or if the
/// tilt of the table or the mount changes, the means are the original readings.
[[nodiscard]] MeanReadings average_poses(const ReadingSet& given, const Estimate& estimate);

}  // namespace axiscal
