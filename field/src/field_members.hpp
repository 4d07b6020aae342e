// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "axiscal/field/site.hpp"
#include "core/json_members.hpp"

namespace axiscal {

/// JSON members of a field that a model computes for a site, without and with a date.
inline constexpr std::array<std::string_view, 2> members_with_site = {"model", "site"};
inline constexpr std::array<std::string_view, 3> members_with_date = {"model", "site", "date"};

/// Reads or writes a model's name. The name is not written if it equals `usual`.
void model_members(JsonMembers& io, std::string& model, const std::string& usual);

/// Reads or writes the field's own site, if it has one.
void site_members(JsonMembers& io, std::optional<Site>& site);

}  // namespace axiscal
