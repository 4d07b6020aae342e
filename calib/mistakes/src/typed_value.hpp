// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace axiscal {

/// What was probably meant where a value was typed wrong: one digit, two digits exchanged, the
/// decimal point moved, the sign.
/// @param typed      the value as it stands.
/// @param expected   by all other readings.
/// @param tolerance  how far from it the value that was meant may be.
/// @return the value meant that is nearest; nothing where no such slip leads there, or where the
///         value has too few digits for it to be no chance.
[[nodiscard]] std::optional<double> probably_meant(double typed, double expected, double tolerance);

}  // namespace axiscal
