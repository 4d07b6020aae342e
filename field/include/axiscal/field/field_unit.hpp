// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// The factor between two units: `value_to = factor_between(from, to) * value_from`.
///
/// Only units of one quantity convert: acceleration, magnetic flux density, angular rate,
/// irradiance. `g` is local gravity and converts only to `g`.
/// @throws DomainError  if the units belong to different quantities, or they differ and one is
///                      unknown.
[[nodiscard]] AXISCAL_EXPORT double factor_between(std::string_view from, std::string_view to);

/// As factor_between(), for the unit of readings. `g` is standard gravity. V, mg, gauss and similar
/// units are known too.
/// @return nullopt if the units belong to different quantities, or if they differ and one is
///         unknown.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> reading_factor_between(std::string_view from,
                                                                          std::string_view to);

/// @return true if a unit of readings can be converted: m/s^2, g, V, deg/s, gauss, ...
[[nodiscard]] AXISCAL_EXPORT bool is_reading_unit(std::string_view name);

}  // namespace axiscal
