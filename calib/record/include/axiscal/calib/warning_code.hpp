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
  other,  ///< unknown code in a record of another version
};

/// The name and the properties of a warning code.
struct WarningKind {
  std::string_view name;      ///< name in records, for example "wrong_pose"
  bool refuses = false;       ///< true: the calibration is refused
  bool spoils_slope = false;  ///< true: the table's slope is unreliable too
};

[[nodiscard]] AXISCAL_EXPORT const WarningKind& warning_kind(WarningCode code);

/// @return the name of a warning code in records.
[[nodiscard]] inline std::string_view warning_name(WarningCode code) {
  return warning_kind(code).name;
}

/// @return the code of that name; `other` for an unknown name.
[[nodiscard]] AXISCAL_EXPORT WarningCode warning_code_of(std::string_view name);

}  // namespace axiscal
