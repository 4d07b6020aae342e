// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace axiscal {

/// Infers the intended value from a value with a typing error: a wrong digit, two exchanged digits,
/// a moved decimal point or a wrong sign.
/// @param typed      the value in the run.
/// @param expected   the prediction by all other readings.
/// @param tolerance  the largest accepted difference between the result and `expected`.
/// @return the possible value nearest to `expected`; nullopt if no typing error explains the value,
///         or if it has fewer than 4 digits.
[[nodiscard]] std::optional<double> infer_intended_value(double typed,
                                                         double expected,
                                                         double tolerance);

}  // namespace axiscal
