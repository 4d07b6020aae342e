// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// Finds the rounding step of an axis's readings. If all readings differ by multiples of the stated
/// step, the result is the stated step. Otherwise it is the largest multiple of the last decimal
/// digit that divides all differences of the readings.
///
/// If this multiple is far below the noise, a step that is not a multiple of the last digit is
/// sought, for example the step of integer counts that were multiplied by a factor. The result is
/// then the largest step that divides all differences to within the last digit. A step is accepted
/// if its probability by chance is below 0.001.
///
/// @param readings     the readings of one axis [unit].
/// @param stated_step  [unit]; 0: not stated.
/// @param noise_sd     standard deviation of one reading [unit]; if infinite, a step that is not a
///                     multiple of the last digit is always sought.
/// @return the step [unit]; nullopt if the readings do not show a step.
[[nodiscard]] std::optional<double> detect_rounding_step(
    std::vector<double> readings,
    double stated_step,
    double noise_sd = std::numeric_limits<double>::infinity());

/// @return the readings whose weight is above 0, in their order.
[[nodiscard]] std::vector<double> readings_with_weight(
    const Eigen::Ref<const Eigen::VectorXd>& readings,
    const Eigen::Ref<const Eigen::VectorXd>& weights);

/// Finds the rounding step of each reading. A meter that changes its range, or that shows a fixed
/// number of digits, rounds large readings to a wider step than small ones. The wider step is
/// searched for among the largest readings of all axes. A step that the readings of all axes have
/// in common is a step of each axis, because few distinct readings of one axis do not show it.
///
/// @param response  n x m [unit].
/// @param weights   n x m; readings of weight 0 do not count.
/// @param noise_sd  m: standard deviation of one reading of each axis [unit]; empty: infinite for
///                  all axes.
/// @return n x m: the step of each reading [unit]; 0 if the readings do not show a step.
[[nodiscard]] Eigen::MatrixXd detect_rounding_steps(const Eigen::MatrixXd& response,
                                                    const Eigen::MatrixXd& weights,
                                                    double stated_step,
                                                    const Eigen::VectorXd& noise_sd = {});

}  // namespace axiscal
