// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// The factor between two units: `value_to = factor_between(from, to) * value_from`.
///
/// Both units must measure the same quantity: acceleration, magnetic flux density, angular rate, or
/// irradiance. `g` is local gravity and can be converted only to `g`.
/// @throws DomainError  if the units belong to different quantities, or they differ and one is
///                      unknown.
[[nodiscard]] AXISCAL_EXPORT double factor_between(std::string_view from, std::string_view to);

/// As factor_between(), but for units of readings. Here `g` is standard gravity, and V, mg, gauss
/// and similar units are known too.
/// @return nullopt if the units belong to different quantities, or if they differ and one is
///         unknown.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> reading_factor_between(std::string_view from,
                                                                          std::string_view to);

/// @return true if `name` is a unit that reading_factor_between() knows: m/s^2, g, V, deg/s, ...
[[nodiscard]] AXISCAL_EXPORT bool is_reading_unit(std::string_view name);

}  // namespace axiscal
