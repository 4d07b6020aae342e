// SPDX-License-Identifier: Apache-2.0
#include "part_resolver.hpp"

namespace axiscal {

void resolve_turntable(PartResolver& of) {
  of.part().part.turning = true;
  of.put_given_magnitude("the turntable's rate");
  of.part().part.in_table = {0.0, 0.0, of.part().part.magnitude};
  of.part().has_value = true;
  of.part().sign_by = Eigen::Vector3d::UnitZ();
}

}  // namespace axiscal
