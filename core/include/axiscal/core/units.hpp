// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

#include "axiscal/core/version.hpp"

namespace axiscal {

/// Conversion constants, named unit_per_unit: `angle_rad = angle_deg * rad_per_deg`.
inline constexpr double rad_per_deg = std::numbers::pi / 180.0;
inline constexpr double deg_per_rad = 180.0 / std::numbers::pi;

/// Standard acceleration of gravity [m/s^2] (3rd CGPM, 1901). Drivers use it for 1 g.
inline constexpr double standard_gravity = 9.80665;

}  // namespace axiscal
