// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// The scatter of a parameter between the blocks of a record.
struct BlockScatter {
  double mean_square = 0.0;  ///< M: mean square of the blocks' values about their mean
  /// Degrees of freedom of mean_square; 0 if mean_square is unknown.
  double degrees_of_freedom = 0.0;
  double blocks = 1.0;  ///< number of blocks

  /// @return the variance with which the parameter in a new block scatters about the record's
  ///         value; 0 if it is unknown.
  [[nodiscard]] double of_another_block() const {
    return degrees_of_freedom > 0.0 ? mean_square * (1.0 + 1.0 / blocks) : 0.0;
  }
};

/// @param parameter  a bias or a sensitivity of the record.
/// @return the scatter of the parameter between the record's blocks.
[[nodiscard]] BlockScatter scatter_of_blocks(const Calibration& record,
                                             const std::string& parameter);

/// @return the covariance of a record's parameters without the scatter between blocks.
[[nodiscard]] Eigen::MatrixXd covariance_within_blocks(const Calibration& record);

/// Returns the p-value of the difference between two records of one unit, if at least one of them
/// has several blocks. The parameters form three classes (biases, main terms, cross terms). Each
/// class is tested against the scatter between blocks and against the noise of the readings, and
/// the larger p-value is used. The smallest p-value of the three classes is then multiplied by 3
/// (docs/method/watching.md).
///
/// @return nullopt if neither record states the scatter between blocks.
[[nodiscard]] std::optional<double> p_of_block_changes(const Calibration& old,
                                                       const Calibration& fresh,
                                                       std::vector<std::string>& notes);

}  // namespace axiscal
