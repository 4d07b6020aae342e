// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/earth_rotation_field.hpp"

#include <array>
#include <cmath>
#include <utility>

#include "axiscal/core/units.hpp"
#include "axiscal/field/field_resolver.hpp"
#include "axiscal/field/field_unit.hpp"
#include "core/json_members.hpp"
#include "field/src/field_entries.hpp"
#include "field/src/field_members.hpp"

namespace axiscal {

EarthRotationField::EarthRotationField(const Site& site, std::string unit)
    : unit_(std::move(unit)), site_(site) {
  check_site(site);
  const double latitude_rad = site.latitude_deg * rad_per_deg;
  value_ = factor_between("rad/s", unit_) * earth_rate_rad_per_s *
           Eigen::Vector3d(0.0, std::cos(latitude_rad), std::sin(latitude_rad));
}

void EarthRotationField::state(FieldSetup& setup) const {
  setup.unit = unit_;
}

void EarthRotationField::resolve(FieldResolver& of) const {
  const std::optional<Site>& site = site_ ? site_ : of.site();
  if (!site) {
    of.set_magnitude(of.given_magnitude().value_or(factor_between("rad/s", of.found().unit) *
                                                   earth_rate_rad_per_s));
    return;
  }
  const EarthRotationField there(*site, of.found().unit);
  of.set_magnitude(of.given_magnitude().value_or(there.magnitude()));
  of.set_direction(there.value_in_enu(), false);
}

void EarthRotationField::members(JsonMembers& io) {
  site_members(io, site_);
}

FieldKind earth_rotation_entry() {
  static constexpr std::array<std::string_view, 3> units = {"rad/s", "deg/s", "deg/h"};
  static constexpr std::array<std::string_view, 1> members = {"site"};
  return {.name = "earth_rotation",
          .units = units,
          .local = true,
          .rotation = true,
          .members = members,
          .make = maker_of<EarthRotationField>()};
}

}  // namespace axiscal
