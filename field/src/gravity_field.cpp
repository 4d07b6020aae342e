// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/gravity_field.hpp"

#include <cmath>
#include <utility>

#include <GeographicLib/NormalGravity.hpp>

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

double normal_gravity(const Site& site) {
  check_site(site);
  double northward = 0.0;
  double upward = 0.0;
  GeographicLib::NormalGravity::WGS84().Gravity(site.latitude_deg, site.height_m, northward,
                                                upward);
  return std::hypot(northward, upward);
}

}  // namespace

GravityField::GravityField(const Site& site) : GravityField(normal_gravity(site), "m/s^2") {}

GravityField::GravityField(double magnitude, std::string unit)
    : magnitude_(magnitude), unit_(std::move(unit)) {
  if (!(magnitude > 0.0) || !std::isfinite(magnitude)) {
    throw DomainError("GravityField: the magnitude must be positive and finite");
  }
}

}  // namespace axiscal
