// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/warning_code.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace axiscal {
namespace {

// The kinds, in the order of the enumerators of WarningCode.
constexpr std::array warning_kinds = {
    WarningKind{.name = "wrong_pose"},
    WarningKind{.name = "exchanged"},
    WarningKind{.name = "columns_exchanged"},
    WarningKind{.name = "sign"},
    WarningKind{.name = "unit_factor"},
    WarningKind{.name = "stuck"},
    WarningKind{.name = "wrong_level"},
    WarningKind{.name = "tilted_seat"},
    WarningKind{.name = "drift"},
    WarningKind{.name = "temperature"},
    WarningKind{.name = "levelness", .spoils_slope = true},
    WarningKind{.name = "table_moved", .spoils_slope = true},
    WarningKind{.name = "slot_levelness", .spoils_slope = true},
    WarningKind{.name = "outlier"},
    WarningKind{.name = "no_fit", .refuses = true},
    WarningKind{.name = "uncertain_direction", .refuses = true, .spoils_slope = true},
    WarningKind{.name = "uncertain_sensitivity", .refuses = true},
    WarningKind{.name = "sensitivity"},
    WarningKind{.name = "reading_unit", .refuses = true},
    WarningKind{.name = "saturated"},
    WarningKind{.name = "bias_step"},
    WarningKind{.name = "memory"},
    WarningKind{.name = "repeated_readings"},
    WarningKind{.name = "unsettled"},
    WarningKind{.name = "two_solutions"},
    WarningKind{.name = "one_sided_unsettled", .refuses = true},
    WarningKind{.name = "coverage"},
    WarningKind{.name = "alignment"},
    WarningKind{.name = "not_converged"},
    WarningKind{.name = "poor_fit", .spoils_slope = true},
    WarningKind{.name = "axis_reversed"},
    WarningKind{.name = "axis_swapped"},
    WarningKind{.name = "lack_of_fit"},
    WarningKind{.name = "nonlinearity"},
    WarningKind{.name = "slope"},
    WarningKind{.name = "field_magnitude"},
    WarningKind{.name = "field_length"},
    WarningKind{.name = "impossible_field", .refuses = true},
    WarningKind{.name = "field_in_bias"},
    WarningKind{.name = "log"},
    WarningKind{.name = "seat"},
    WarningKind{.name = "many_revolutions"},
    WarningKind{.name = "unpaired"},
    WarningKind{.name = "ill_conditioned"},
    WarningKind{.name = "no_redundancy"},
    WarningKind{.name = "other"}};
static_assert(warning_kinds.size() == static_cast<std::size_t>(WarningCode::other) + 1);

}  // namespace

const WarningKind& warning_kind(WarningCode code) {
  return warning_kinds[static_cast<std::size_t>(code)];
}

WarningCode warning_code_of(std::string_view name) {
  const auto* const found =
      std::find_if(warning_kinds.begin(), warning_kinds.end() - 1,
                   [&](const WarningKind& kind) { return kind.name == name; });
  return static_cast<WarningCode>(found - warning_kinds.begin());
}

}  // namespace axiscal
