// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace axiscal {

/// The example files in the folder cli/templates, one for each format that a user writes by hand.
[[nodiscard]] std::string_view experiment_template();
[[nodiscard]] std::string_view laboratory_template();
[[nodiscard]] std::string_view limits_template();
[[nodiscard]] std::string_view map_template();
[[nodiscard]] std::string_view positioner_template();
[[nodiscard]] std::string_view world_template();

}  // namespace axiscal
