// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

std::shared_ptr<const Solution> SolvedReadings::at(const TableField& field) const {
  const bool is_at_hand = solution_ && solution_->field().vectors() == field.vectors();
  return is_at_hand ? solution_ : Model(set_, directions_known_).at({.field = field});
}

}  // namespace axiscal
