// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// A value to the decimals that show two digits of its uncertainty (GUM 7.2.6): "0.01196" of
/// 0.0119603 and 0.00027. Where that is longer than twelve characters, or beyond eight decimals, in
/// powers of ten; without an uncertainty six digits.
/// @return "-" of NaN.
[[nodiscard]] AXISCAL_EXPORT std::string rounded_value(double value, double uncertainty);

/// An uncertainty with two digits, in the format of rounded_value(); "-" if it is not finite.
[[nodiscard]] AXISCAL_EXPORT std::string rounded_uncertainty(double uncertainty);

}  // namespace axiscal
