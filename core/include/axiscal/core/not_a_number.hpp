// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace axiscal {

/// Represents an unknown number. Only std::isnan() recognises it.
inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

}  // namespace axiscal
