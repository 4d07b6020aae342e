// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// States whether the experimenter sets a part of the field (induced), or the part exists at the
/// site (local).
enum class FieldRole {
  local,    ///< the field exists at the site and is constant
  induced,  ///< the experimenter sets the field; each reading's level multiplies it
};

/// @return the role of that name ("local", "induced"), or nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<FieldRole> parse_role(std::string_view name);

/// @return "local" or "induced"; empty for nullopt.
[[nodiscard]] AXISCAL_EXPORT std::string_view role_name(std::optional<FieldRole> role);

}  // namespace axiscal
