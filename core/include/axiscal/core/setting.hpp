// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace axiscal {

/// Something that a user can state, by its path in what is stated: "field.magnitude" is the member
/// `magnitude` of an experiment's field. An error carries the settings that would mend it, and a
/// program makes its own names of them: the command its options, a dialogue its fields. Each module
/// has those that it asks for in its `settings.hpp`.
struct Setting {
  std::string_view path;  ///< of a literal

  friend constexpr bool operator==(Setting a, Setting b) { return a.path == b.path; }
};

}  // namespace axiscal
