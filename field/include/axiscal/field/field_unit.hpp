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
/// irradiance. `g` is the gravity of a place and converts to nothing but itself here.
/// @throws DomainError  if the two are not of one quantity, or one is not known and not the other.
[[nodiscard]] AXISCAL_EXPORT double factor_between(std::string_view from, std::string_view to);

/// As factor_between(), for the unit of readings: `g` is the standard gravity, and V, mg, gauss and
/// similar units are known too.
/// @return nullopt if the units belong to different quantities, or only one is known.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> reading_factor_between(std::string_view from,
                                                                          std::string_view to);

/// @return true if a unit of readings can be converted: m/s^2, g, V, deg/s, gauss, ...
[[nodiscard]] AXISCAL_EXPORT bool is_reading_unit(std::string_view name);

}  // namespace axiscal
