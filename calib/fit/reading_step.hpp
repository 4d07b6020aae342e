// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <vector>

namespace axiscal {

/// The rounding step of an axis's readings. It is the stated step, if the readings are multiples of
/// it; otherwise the largest number of last digits of which all readings are multiples. If that is
/// far below the noise, it is the largest step of which all readings are multiples within their
/// last digit, for example the step of counts multiplied by a factor. A step is accepted if chance
/// gives one in fewer than 1 of 1000 cases.
///
/// @param readings     of one axis [unit].
/// @param stated_step  [unit]; 0: not stated.
/// @param noise_sd     of one reading [unit]; without it any step is looked for.
/// @return [unit]; nullopt if the readings do not show a step.
[[nodiscard]] std::optional<double> step_of_readings(
    std::vector<double> readings,
    double stated_step,
    double noise_sd = std::numeric_limits<double>::infinity());

}  // namespace axiscal
