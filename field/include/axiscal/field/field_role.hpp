// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// The role of a part of the field: the experimenter sets it (induced) or finds it in place
/// (local).
enum class FieldRole {
  local,    ///< it is found at the site, and stays as it is
  induced,  ///< it is made on the table, and each reading states the multiple of it that was set
};

/// @return the role of that name ("local", "induced"), or nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<FieldRole> parse_role(std::string_view name);

/// @return "local", "induced"; empty for nothing.
[[nodiscard]] AXISCAL_EXPORT std::string_view role_name(std::optional<FieldRole> role);

}  // namespace axiscal
