// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/state_of_run.hpp"

namespace axiscal {

std::shared_ptr<const Solution> StateOfRun::at(const TableField& field) {
  if (!is_of(field)) {
    last_ = Model(set_, known_field_).at({.field = field});
  }
  return last_;
}

}  // namespace axiscal
