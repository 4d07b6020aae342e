// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// How much readings that are taken in a further block may differ from a record of several blocks.
struct BlockScatter {
  double mean_square = 0.0;         ///< M, of one block's parameter about the mean of them
  double degrees_of_freedom = 0.0;  ///< 0: unknown
  double blocks = 1.0;
};

/// @param parameter  a bias or a sensitivity of the record.
/// @return what the record's blocks say of it.
[[nodiscard]] BlockScatter scatter_of_blocks(const Calibration& record,
                                             const std::string& parameter);

/// The covariance of a record's parameters without the components that blocks make.
[[nodiscard]] Eigen::MatrixXd covariance_within_blocks(const Calibration& record);

/// How likely two records of one unit differ by as much as they do by chance, where at least one of
/// them has several blocks: biases, main terms and cross terms against the scatter of blocks and
/// against that of readings, the less likely to be a change of both, three tests (method.md,
/// section 8).
///
/// @return nothing where neither record says how blocks differ.
[[nodiscard]] std::optional<double> p_of_block_changes(const Calibration& old,
                                                       const Calibration& fresh,
                                                       std::vector<std::string>& notes);

}  // namespace axiscal
