// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/export.hpp"

namespace axiscal {

/// A place on or above the Earth. Latitude and longitude are in degrees; all other angles in the
/// library are in radians.
struct Site {
  double latitude_deg = 0.0;   ///< geodetic latitude (WGS 84), north positive, -90 to 90 degrees
  double longitude_deg = 0.0;  ///< longitude, east positive, -180 to 360 degrees
  double height_m = 0.0;       ///< height above the WGS 84 ellipsoid, -20 km to 1000 km
};

/// @throws DomainError  if a member of `site` is not finite or out of its range.
AXISCAL_EXPORT void check_site(const Site& site);

}  // namespace axiscal
