// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// An estimate of the table's levelness (see Levelness) from readings that have the same rest face
/// and opposite fence faces.
struct LevelnessEstimate {
  DesignPoint point;  ///< rest face and the first of the two fence faces
  int block = 1;
  /// The field's component along the table's x, divided by the field's magnitude. For gravity it is
  /// the slope of the table along x.
  double x = 0.0;
  double y = 0.0;  ///< like x, but along the table's y
};

/// The levelness of the table during one block of readings.
struct BlockLevelness {
  int block = 1;
  double x = 0.0;  ///< as in LevelnessEstimate
  double y = 0.0;
  double standard_error_x = 0.0;
  double standard_error_y = 0.0;
};

/// The joint estimate of the levelness from all instruments of an assembly. The instruments stand
/// on one table. If each block has its own levelness, the estimate is for the last block.
struct CombinedLevelness {
  std::vector<std::string> slots;
  double x = 0.0;  ///< mean of the slots' estimates, weighted by 1 / variance
  double y = 0.0;
  double standard_error_x = 0.0;
  double standard_error_y = 0.0;
  double p_value = 1.0;    ///< p-value of the test that the slots agree; NaN if not testable
  bool consistent = true;  ///< true if p_value is 0.001 or more, or NaN
  std::string suspect;     ///< slot that disagrees; empty if consistent or with only two slots
};

/// The field's components along the table's x and y, divided by its magnitude. For gravity they are
/// slopes: x > 0 means that the table rises towards +x.
struct AXISCAL_EXPORT Levelness {
  std::vector<LevelnessEstimate> estimates;
  double mean_x = 0.0;
  double mean_y = 0.0;
  double sd_x = 0.0;  ///< standard deviation of the estimates; NaN for fewer than two
  double sd_y = 0.0;
  double standard_error_x = 0.0;  ///< standard error of mean_x, from the scatter of the readings
  double standard_error_y = 0.0;
  double degrees_of_freedom = 0.0;  ///< degrees of freedom of the standard errors
  bool consistent = true;           ///< true if p_value is 0.005 or more, or NaN
  double p_value = 0.0;        ///< p-value of the test that the faces agree; NaN if not testable
  double block_p_value = 1.0;  ///< p-value of the test that the blocks agree; NaN if not testable
  /// Estimate from the rest face that disagrees with the other faces; nullopt if consistent.
  std::optional<LevelnessEstimate> suspect;
  std::vector<BlockLevelness>
      blocks;  ///< the levelness of each block; empty if one levelness was fitted for the run
  std::optional<CombinedLevelness> combined;  ///< the joint result of an assembly's slots

  /// @return the slope of the table at the end of the run. If each block has its own slope, it is
  ///         that of the last block. Otherwise it is the mean.
  [[nodiscard]] BlockLevelness current_levelness() const {
    return blocks.empty() ? BlockLevelness{.x = mean_x,
                                           .y = mean_y,
                                           .standard_error_x = standard_error_x,
                                           .standard_error_y = standard_error_y}
                          : blocks.back();
  }

  /// @return x and y of blocks[position]; mean_x and mean_y if `blocks` is empty.
  [[nodiscard]] Eigen::Vector2d of_block_at(std::size_t position) const {
    return blocks.empty() ? Eigen::Vector2d(mean_x, mean_y)
                          : Eigen::Vector2d(blocks.at(position).x, blocks.at(position).y);
  }
};

}  // namespace axiscal
