// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/site.hpp"

namespace axiscal {

/// The apparent position of the sun.
struct AXISCAL_EXPORT SunPosition {
  double azimuth_rad = 0.0;                                     ///< clockwise from north, 0 to 2 pi
  double elevation_rad = 0.0;                                   ///< elevation above the horizon
  Eigen::Vector3d direction_in_enu = Eigen::Vector3d::UnitZ();  ///< unit vector towards the sun
};

/// Computes the sun's apparent position at a site. The error is at most 0.01 degrees from 1950 to
/// 2050.
///
/// The computation includes the equation of the centre, aberration, the largest term of nutation,
/// and diurnal parallax. It takes UTC as universal time, and UTC + 69 s as terrestrial time.
///
/// @param site        the place; its latitude is geodetic.
/// @param time_s      seconds since 1970-01-01, UTC.
/// @param refraction  true: includes refraction by a standard atmosphere (1010 hPa, 10 C); false:
///                    the geometric position.
/// @throws DomainError  if the site is out of range or the time is not finite.
/// @par Source
/// Meeus, Astronomical Algorithms, 2nd ed. (1998): low-accuracy position of the sun (ch. 25),
/// sidereal time (ch. 12), parallax (ch. 40), refraction by Saemundsson's formula (ch. 16).
[[nodiscard]] AXISCAL_EXPORT SunPosition sun_position(const Site& site,
                                                      double time_s,
                                                      bool refraction = false);

}  // namespace axiscal
