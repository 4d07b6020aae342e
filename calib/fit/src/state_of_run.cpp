// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/state_of_run.hpp"

namespace axiscal {

std::shared_ptr<const JointState> StateOfRun::at(const TableField& field) {
  if (!is_of(field)) {
    last_ = JointFit(set_, set_.weights).at(field, known_field_ || !field.has_vectors());
    small_.reset();
  }
  return last_;
}

const SmallState* StateOfRun::small(const TableField& field) {
  if (!SmallState::can_be(set_) || !field.has_vectors()) {
    return nullptr;
  }
  const std::shared_ptr<const JointState> state = at(field);
  if (!small_) {
    small_ = SmallState::of(set_, *state);
  }
  return small_ ? &*small_ : nullptr;
}

}  // namespace axiscal
