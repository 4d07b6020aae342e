// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// @param values  one or more.
/// @return the median; of an even number the upper one of the two in the middle.
[[nodiscard]] AXISCAL_EXPORT double upper_median(std::vector<double> values);

}  // namespace axiscal
