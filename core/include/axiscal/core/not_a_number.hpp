// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace axiscal {

/// The value of an unknown number. Test for it with std::isnan(), because it is not equal to
/// itself.
inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

}  // namespace axiscal
