// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace axiscal {

/// The value that was probably meant, for a value with a typing error: one digit, two exchanged
/// digits, a moved decimal point, the sign.
/// @param typed      the value as it stands.
/// @param expected   by all other readings.
/// @param tolerance  how far from it the value that was meant may be.
/// @return the nearest such value; nullopt if no typing error explains the value, or if the value
///         has so few digits that chance could.
[[nodiscard]] std::optional<double> infer_intended_value(double typed,
                                                         double expected,
                                                         double tolerance);

}  // namespace axiscal
