// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// Finds the known name that is most similar to a mistyped name.
///
/// An edit inserts, deletes or replaces a character, or swaps two neighbours. Case is ignored.
/// @return the candidate with the fewest edits from `name`, if it has at most
///         max(1, name.size() / 3) edits. Otherwise, if `name` has 3 characters or more, the first
///         candidate that begins with `name`. Otherwise, an empty text.
[[nodiscard]] AXISCAL_EXPORT std::string_view nearest_name(
    std::string_view name, std::span<const std::string_view> candidates);

/// @return "; did you mean 'NAME'?", where NAME is the result of nearest_name(); "" if
///         nearest_name() returns "".
[[nodiscard]] AXISCAL_EXPORT std::string did_you_mean(std::string_view name,
                                                      std::span<const std::string_view> candidates);

/// Appends `what_there_is`, e.g. "there are a, b", to the question of the other did_you_mean().
/// @return "; there are a, b", or "; did you mean 'a'? There are a, b".
[[nodiscard]] AXISCAL_EXPORT std::string did_you_mean(std::string_view name,
                                                      std::span<const std::string_view> candidates,
                                                      std::string_view what_there_is);

}  // namespace axiscal
