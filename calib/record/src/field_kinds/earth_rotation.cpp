// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/earth_rotation_field.hpp"
#include "axiscal/field/field_unit.hpp"
#include "part_resolver.hpp"

namespace axiscal {

void resolve_earth_rotation(PartResolver& of) {
  if (of.has_site()) {
    const EarthRotationField field(of.site(), of.part().unit);
    of.put_magnitude(of.given_magnitude().value_or(field.magnitude()));
    of.put_value(field.value_in_enu(), false);
    return;
  }
  of.put_magnitude(of.given_magnitude().value_or(factor_between("rad/s", of.part().unit) *
                                                 earth_rate_rad_per_s));
}

}  // namespace axiscal
