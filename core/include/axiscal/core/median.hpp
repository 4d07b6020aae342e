// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// @param values  at least one value.
/// @return the median; for an even number of values, the larger of the two middle values.
[[nodiscard]] AXISCAL_EXPORT double upper_median(std::vector<double> values);

}  // namespace axiscal
