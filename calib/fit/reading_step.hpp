// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <vector>

namespace axiscal {

/// The step that readings of an axis are rounded to: the one that was stated, if they are multiples
/// of it; else the largest number of last digits that all are multiples of; where that is far below
/// the noise, the largest step that all are multiples of within their last digit, as counts that
/// were multiplied with a factor are. A step counts where chance makes one in fewer than 1 in 1000.
///
/// @param readings     of one axis [unit].
/// @param stated_step  [unit]; 0: not stated.
/// @param noise_sd     of one reading [unit]; without it any step is looked for.
/// @return [unit]; nothing where the readings show no step.
[[nodiscard]] std::optional<double> step_of_readings(
    std::vector<double> readings,
    double stated_step,
    double noise_sd = std::numeric_limits<double>::infinity());

}  // namespace axiscal
