// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace axiscal {

/// How many of one unit make one of another: `value_to = factor_between(from, to) * value_from`.
///
/// Only units of one quantity convert: acceleration, magnetic flux density, angular rate,
/// irradiance. `g` is the gravity of a place and converts to nothing but itself here.
/// @throws DomainError  if the two are not of one quantity, or one is not known and not the other.
[[nodiscard]] double factor_between(std::string_view from, std::string_view to);

/// As factor_between(), of what an instrument reads: there `g` is the standard gravity.
/// @return nothing if the two are not of one quantity, or one is not known and not the other.
[[nodiscard]] std::optional<double> reading_factor_between(std::string_view from,
                                                           std::string_view to);

}  // namespace axiscal
