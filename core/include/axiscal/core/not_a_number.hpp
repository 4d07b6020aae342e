// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace axiscal {

/// Stands for a number that is not known; only std::isnan() tells it.
inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

}  // namespace axiscal
