// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace axiscal {

/// @param values  one or more.
/// @return the median; of an even number the upper one of the two in the middle.
[[nodiscard]] double upper_median(std::vector<double> values);

}  // namespace axiscal
