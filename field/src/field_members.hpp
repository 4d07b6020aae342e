// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "axiscal/field/site.hpp"
#include "core/json_members.hpp"

namespace axiscal {

/// The members of a kind that a model computes at a site.
inline constexpr std::array<std::string_view, 2> members_with_site = {"model", "site"};
inline constexpr std::array<std::string_view, 3> members_with_date = {"model", "site", "date"};

/// A model's name; not written where it is the usual one.
void model_members(JsonMembers& io, std::string& model, const std::string& usual);

/// The site of the field, if it differs from the table's.
void site_members(JsonMembers& io, std::optional<Site>& site);

}  // namespace axiscal
