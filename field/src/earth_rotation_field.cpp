// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/earth_rotation_field.hpp"

#include <cmath>
#include <utility>

#include "axiscal/core/units.hpp"
#include "axiscal/field/field_unit.hpp"

namespace axiscal {

EarthRotationField::EarthRotationField(const Site& site, std::string unit)
    : unit_(std::move(unit)) {
  check_site(site);
  const double latitude_rad = site.latitude_deg * rad_per_deg;
  value_ = factor_between("rad/s", unit_) * earth_rate_rad_per_s *
           Eigen::Vector3d(0.0, std::cos(latitude_rad), std::sin(latitude_rad));
}

}  // namespace axiscal
