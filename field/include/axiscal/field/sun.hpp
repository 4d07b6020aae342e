// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/site.hpp"

namespace axiscal {

/// Where the sun stands.
struct AXISCAL_EXPORT SunPosition {
  double azimuth_rad = 0.0;                                     ///< clockwise from north, 0 to 2 pi
  double elevation_rad = 0.0;                                   ///< above the horizon
  Eigen::Vector3d direction_in_enu = Eigen::Vector3d::UnitZ();  ///< unit vector towards the sun
};

/// The sun's apparent place at a site, good to 0.01 degrees from 1950 to 2050.
///
/// Equation of the centre, aberration, nutation's largest term, diurnal parallax; the Earth's
/// rotation by UTC, terrestrial time as UTC + 69 s.
///
/// @param site        its latitude is geodetic.
/// @param time_s      seconds since 1970-01-01, UTC.
/// @param refraction  lift by a standard atmosphere (1010 hPa, 10 C); without, the geometric place.
/// @throws DomainError  for a bad site or a time that is not finite.
/// @par Source
/// Meeus, Astronomical Algorithms, 2nd ed. (1998): sun of lower accuracy (ch. 25), sidereal time
/// (ch. 12), parallax (ch. 40), refraction by Saemundsson's formula (ch. 16).
[[nodiscard]] AXISCAL_EXPORT SunPosition sun_position(const Site& site,
                                                      double time_s,
                                                      bool refraction = false);

}  // namespace axiscal
