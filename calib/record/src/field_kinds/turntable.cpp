// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "part_resolver.hpp"

namespace axiscal {

void resolve_turntable(PartResolver& of) {
  if (of.given().role == FieldRole::local) {
    throw SetupError(
        formatted("field {}: is what a turntable makes, and its level sets it; its role is induced",
                  of.given().kind));
  }
  of.part().part.turning = true;
  of.put_given_magnitude("the turntable's rate is not known; state it as the field's magnitude",
                         {});
  of.part().part.in_table = {0.0, 0.0, of.part().part.magnitude};
  of.part().has_value = true;
  of.part().sign_by = Eigen::Vector3d::UnitZ();
}

}  // namespace axiscal
