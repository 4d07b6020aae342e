// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/sun.hpp"

#include <cmath>
#include <numbers>

#include "axiscal/core/error.hpp"
#include "axiscal/core/units.hpp"

namespace axiscal {
namespace {

constexpr double days_per_century = 36525.0;
// Terrestrial time minus UTC from 2017 to 2026. If it were wrong by one minute, the sun's position
// would change by only 0.0007 degrees.
constexpr double terrestrial_less_universal_s = 69.0;

struct EquatorialPlace {
  double right_ascension_rad = 0.0;
  double declination_rad = 0.0;
  double distance_au = 1.0;
  double nutation_in_right_ascension_deg = 0.0;
};

double sine_of_deg(double angle_deg) {
  return std::sin(std::fmod(angle_deg, 360.0) * rad_per_deg);
}

double cosine_of_deg(double angle_deg) {
  return std::cos(std::fmod(angle_deg, 360.0) * rad_per_deg);
}

// Computes the sun's apparent place by Meeus, ch. 25. T is in Julian centuries of terrestrial time
// from 2000 January 1.5.
EquatorialPlace apparent_sun(double T) {
  const double mean_longitude_deg = 280.46646 + T * (36000.76983 + 0.0003032 * T);
  const double anomaly_deg = 357.52911 + T * (35999.05029 - 0.0001537 * T);
  const double eccentricity = 0.016708634 - T * (0.000042037 + 0.0000001267 * T);
  const double centre_deg = (1.914602 - T * (0.004817 + 0.000014 * T)) * sine_of_deg(anomaly_deg) +
                            (0.019993 - 0.000101 * T) * sine_of_deg(2.0 * anomaly_deg) +
                            0.000289 * sine_of_deg(3.0 * anomaly_deg);
  const double node_deg = 125.04 - 1934.136 * T;
  const double nutation_deg = -0.00478 * sine_of_deg(node_deg);
  constexpr double aberration_deg = -0.00569;
  const double longitude_deg = mean_longitude_deg + centre_deg + aberration_deg + nutation_deg;
  const double obliquity_deg = 23.0 + 26.0 / 60.0 +
                               (21.448 - T * (46.8150 + T * (0.00059 - 0.001813 * T))) / 3600.0 +
                               0.00256 * cosine_of_deg(node_deg);
  EquatorialPlace place;
  place.right_ascension_rad = std::atan2(cosine_of_deg(obliquity_deg) * sine_of_deg(longitude_deg),
                                         cosine_of_deg(longitude_deg));
  place.declination_rad = std::asin(sine_of_deg(obliquity_deg) * sine_of_deg(longitude_deg));
  place.distance_au = 1.000001018 * (1.0 - eccentricity * eccentricity) /
                      (1.0 + eccentricity * cosine_of_deg(anomaly_deg + centre_deg));
  place.nutation_in_right_ascension_deg = nutation_deg * cosine_of_deg(obliquity_deg);
  return place;
}

// Computes the sidereal time by Meeus, ch. 12. `days` is universal time from 2000 January 1.5.
double mean_sidereal_time_deg(double days) {
  const double T = days / days_per_century;
  return std::fmod(280.46061837 + 360.98564736629 * days + T * T * (0.000387933 - T / 38710000.0),
                   360.0);
}

// Returns the refraction at a geometric elevation [rad], by Saemundsson's formula.
double refraction_rad(double elevation_rad) {
  const double h = elevation_rad * deg_per_rad;
  constexpr double lowest_deg = -1.0;  // below this, the sun has set
  if (h < lowest_deg) {
    return 0.0;
  }
  const double minutes = 1.02 / std::tan((h + 10.3 / (h + 5.11)) * rad_per_deg);
  return minutes / 60.0 * rad_per_deg;
}

}  // namespace

SunPosition sun_position(const Site& site, double time_s, bool refraction) {
  check_site(site);
  if (!std::isfinite(time_s)) {
    throw DomainError("sun_position: the time must be finite");
  }
  constexpr double noon_of_2000_s = 946728000.0;
  const double days = (time_s - noon_of_2000_s) / 86400.0;
  const EquatorialPlace sun =
      apparent_sun((days + terrestrial_less_universal_s / 86400.0) / days_per_century);
  const double hour_angle_rad =
      (mean_sidereal_time_deg(days) + sun.nutation_in_right_ascension_deg + site.longitude_deg) *
          rad_per_deg -
      sun.right_ascension_rad;
  const double latitude_rad = site.latitude_deg * rad_per_deg;
  const double declination = sun.declination_rad;
  SunPosition position;
  Eigen::Vector3d& enu = position.direction_in_enu;
  enu = {-std::cos(declination) * std::sin(hour_angle_rad),
         std::sin(declination) * std::cos(latitude_rad) -
             std::cos(declination) * std::cos(hour_angle_rad) * std::sin(latitude_rad),
         std::sin(declination) * std::sin(latitude_rad) +
             std::cos(declination) * std::cos(hour_angle_rad) * std::cos(latitude_rad)};
  // Parallax: the observer is on the surface, one Earth radius above the Earth's centre.
  constexpr double horizontal_parallax_rad = 8.794 / 3600.0 * rad_per_deg;
  enu.z() -= std::sin(horizontal_parallax_rad) / sun.distance_au;
  enu.normalize();
  position.elevation_rad = std::asin(enu.z());
  position.azimuth_rad = std::atan2(enu.x(), enu.y());
  if (position.azimuth_rad < 0.0) {
    position.azimuth_rad += 2.0 * std::numbers::pi;
  }
  if (refraction) {
    position.elevation_rad += refraction_rad(position.elevation_rad);
    const double horizontal = std::cos(position.elevation_rad);
    enu = {horizontal * std::sin(position.azimuth_rad), horizontal * std::cos(position.azimuth_rad),
           std::sin(position.elevation_rad)};
  }
  return position;
}

}  // namespace axiscal
