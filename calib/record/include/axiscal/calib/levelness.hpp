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

/// One estimate of the table's levelness: from the opposite readings of one rest face.
struct LevelnessEstimate {
  DesignPoint point;  ///< rest face and the first of the two fence faces
  int block = 1;
  double x = 0.0;  ///< field along the table's x / F; for gravity the slope [rad]
  double y = 0.0;
};

/// The levelness of one block, if each block has one.
struct BlockLevelness {
  int block = 1;
  double x = 0.0;  ///< as in LevelnessEstimate
  double y = 0.0;
  double standard_error_x = 0.0;
  double standard_error_y = 0.0;
};

/// The levelness that all instruments of an assembly say together: they stand on one table. Where
/// each block has its own levelness it is that of the last block.
struct CombinedLevelness {
  std::vector<std::string> slots;
  double x = 0.0;  ///< mean, weighted by the slots' variances
  double y = 0.0;
  double standard_error_x = 0.0;
  double standard_error_y = 0.0;
  double p_value = 1.0;    ///< that the slots differ so much by chance; NaN where not testable
  bool consistent = true;  ///< p_value is not below 0.001
  std::string suspect;     ///< where not consistent: the slot; of two nobody knows which, so empty
};

/// The field's components along the table's x and y, divided by its magnitude. For gravity slopes:
/// x > 0 means that the table rises towards +x.
struct AXISCAL_EXPORT Levelness {
  std::vector<LevelnessEstimate> estimates;
  double mean_x = 0.0;
  double mean_y = 0.0;
  double sd_x = 0.0;  ///< spread of the estimates; NaN for fewer than two
  double sd_y = 0.0;
  double standard_error_x =
      0.0;  ///< standard uncertainty of the mean, from the scatter within the differences
  double standard_error_y = 0.0;
  double degrees_of_freedom = 0.0;  ///< those of the standard errors
  bool consistent = true;           ///< p_value is not below 0.005
  double p_value = 0.0;        ///< that estimates differ so much by chance; NaN where not testable
  double block_p_value = 1.0;  ///< that blocks differ so much by chance; NaN where not testable
  std::optional<LevelnessEstimate> suspect;  ///< where not consistent: the face that disagrees
  std::vector<BlockLevelness>
      blocks;  ///< the levelness of each block, if each block has one; otherwise empty
  std::optional<CombinedLevelness> combined;  ///< the joint result of an assembly's slots

  /// @return the slope of the table after the run: that of the last block if each block has one,
  ///         otherwise the mean of the run.
  [[nodiscard]] BlockLevelness current_levelness() const {
    return blocks.empty() ? BlockLevelness{.x = mean_x,
                                           .y = mean_y,
                                           .standard_error_x = standard_error_x,
                                           .standard_error_y = standard_error_y}
                          : blocks.back();
  }

  /// @return the levelness of one block, by its position among them; the mean where there is one.
  [[nodiscard]] Eigen::Vector2d of_block_at(std::size_t position) const {
    return blocks.empty() ? Eigen::Vector2d(mean_x, mean_y)
                          : Eigen::Vector2d(blocks.at(position).x, blocks.at(position).y);
  }
};

}  // namespace axiscal
