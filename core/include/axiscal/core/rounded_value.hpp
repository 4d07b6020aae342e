// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// Rounds a value to the decimal place of the second significant digit of its uncertainty (GUM
/// 7.2.6): 0.0119603 with the uncertainty 0.00027 gives "0.01196". If that text has more than 12
/// characters or 8 decimals, the value is written with an exponent. If the uncertainty is NaN,
/// infinite or not positive, the value has six significant digits.
/// @return the text; "-" if the value is NaN.
[[nodiscard]] AXISCAL_EXPORT std::string rounded_value(double value, double uncertainty);

/// @return the uncertainty with two significant digits, in the format of rounded_value(); "-" if it
///         is not finite.
[[nodiscard]] AXISCAL_EXPORT std::string rounded_uncertainty(double uncertainty);

}  // namespace axiscal
