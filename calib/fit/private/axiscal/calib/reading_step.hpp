// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

namespace axiscal {

/// The step that readings of an axis are rounded to: the one that was stated, if they are multiples
/// of it; else the smallest difference between any two, if all are multiples of that.
///
/// @param readings     of one axis [unit].
/// @param stated_step  [unit]; 0: not stated.
/// @return [unit]; nothing where the readings show no step.
[[nodiscard]] std::optional<double> step_of_readings(std::vector<double> readings,
                                                     double stated_step);

}  // namespace axiscal
