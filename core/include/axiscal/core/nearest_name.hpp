// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// The known name that a mistyped one is most like.
///
/// @return the candidate with the fewest edits (insert, delete, replace, swap of neighbours, case
///         not counted) within a third of the name's length; else one that begins with the name;
///         else "".
[[nodiscard]] AXISCAL_EXPORT std::string_view nearest_name(
    std::string_view name, std::span<const std::string_view> candidates);

/// @return "; did you mean 'NAME'?" for nearest_name(), or "" if no name is near.
[[nodiscard]] AXISCAL_EXPORT std::string did_you_mean(std::string_view name,
                                                      std::span<const std::string_view> candidates);

/// As above, followed by the existing names, e.g. "there are a, b".
/// @return "; there are a, b", or "; did you mean 'a'? There are a, b".
[[nodiscard]] AXISCAL_EXPORT std::string did_you_mean(std::string_view name,
                                                      std::span<const std::string_view> candidates,
                                                      std::string_view what_there_is);

}  // namespace axiscal
