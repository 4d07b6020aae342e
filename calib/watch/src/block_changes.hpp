// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// The possible difference between readings in a further block and a record of several blocks.
struct BlockScatter {
  double mean_square = 0.0;         ///< M, for one block's parameter, about the mean of the blocks
  double degrees_of_freedom = 0.0;  ///< 0: unknown
  double blocks = 1.0;

  /// @return the variance of the parameter of another block about the record's.
  [[nodiscard]] double of_another_block() const {
    return degrees_of_freedom > 0.0 ? mean_square * (1.0 + 1.0 / blocks) : 0.0;
  }
};

/// @param parameter  a bias or a sensitivity of the record.
/// @return the scatter of the parameter between the record's blocks.
[[nodiscard]] BlockScatter scatter_of_blocks(const Calibration& record,
                                             const std::string& parameter);

/// The covariance of a record's parameters without the components that blocks make.
[[nodiscard]] Eigen::MatrixXd covariance_within_blocks(const Calibration& record);

/// The probability of the difference between two records of one unit by chance, if at least one of
/// them has several blocks. Biases, main terms and cross terms are compared with the scatter of
/// blocks and with that of readings. For each class the larger of the two probabilities counts. The
/// result is corrected for three tests (method.md, section 8).
///
/// @return nullopt if neither record shows the scatter between blocks.
[[nodiscard]] std::optional<double> p_of_block_changes(const Calibration& old,
                                                       const Calibration& fresh,
                                                       std::vector<std::string>& notes);

}  // namespace axiscal
