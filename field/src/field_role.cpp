// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/field_role.hpp"

namespace axiscal {

std::optional<FieldRole> parse_role(std::string_view name) {
  if (name == "local") {
    return FieldRole::local;
  }
  return name == "induced" ? std::optional(FieldRole::induced) : std::nullopt;
}

std::string_view role_name(std::optional<FieldRole> role) {
  return !role ? "" : *role == FieldRole::induced ? "induced" : "local";
}

}  // namespace axiscal
