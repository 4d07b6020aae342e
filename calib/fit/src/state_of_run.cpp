// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/state_of_run.hpp"

namespace axiscal {

std::shared_ptr<const JointState> StateOfRun::at(const TableField& field) {
  if (!is_of(field)) {
    last_ = JointFit(set_, set_.weights).at(field, known_field_ || !field.has_vectors());
  }
  return last_;
}

}  // namespace axiscal
