// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/field_unit.hpp"
#include "axiscal/field/induced_field.hpp"
#include "part_resolver.hpp"

namespace axiscal {

void resolve_induced_magnetic(PartResolver& of) {
  if (of.given().coil) {
    of.put_made([&]() -> Eigen::Vector3d {
      return factor_between("T", of.part().unit) * coil_field_in_table_T(*of.given().coil);
    });
    return;
  }
  if (!of.given_magnitude()) {
    of.part().part.free_length = true;  // what else is known must fix the scale
  }
  of.put_magnitude(of.given_magnitude().value_or(1.0));
}

}  // namespace axiscal
