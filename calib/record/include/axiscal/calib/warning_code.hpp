// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// The subject of a warning. For each code, docs/messages.md states the condition and the action.
enum class WarningCode {
  wrong_pose,
  exchanged,
  columns_exchanged,
  sign,
  unit_factor,
  stuck,
  wrong_level,
  tilted_seat,
  drift,
  temperature,
  levelness,
  table_moved,
  slot_levelness,
  outlier,
  no_fit,
  uncertain_direction,
  uncertain_sensitivity,
  sensitivity,
  reading_unit,
  saturated,
  bias_step,
  memory,
  repeated_readings,
  unsettled,
  two_solutions,
  one_sided_unsettled,
  coverage,
  alignment,
  not_converged,
  poor_fit,
  axis_reversed,
  axis_swapped,
  lack_of_fit,
  nonlinearity,
  slope,
  field_magnitude,
  field_length,
  impossible_field,
  field_in_bias,
  log,
  seat,
  many_revolutions,
  unpaired,
  ill_conditioned,
  no_redundancy,
  other,  ///< of a record that another version wrote
};

/// The special property of a warning.
struct WarningKind {
  std::string_view name;      ///< in records: "wrong_pose"
  bool refuses = false;       ///< the whole run is useless
  bool spoils_slope = false;  ///< the table's slope is not to be trusted either
};

[[nodiscard]] AXISCAL_EXPORT const WarningKind& warning_kind(WarningCode code);

/// @return its name in records.
[[nodiscard]] inline std::string_view warning_name(WarningCode code) {
  return warning_kind(code).name;
}

/// @return the code of that name; `other` where none has it.
[[nodiscard]] AXISCAL_EXPORT WarningCode warning_code_of(std::string_view name);

}  // namespace axiscal
