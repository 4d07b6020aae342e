// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace axiscal {

/// The name of an input that a user can set. It is the path of the input in the experiment:
/// "field.magnitude" is the member `magnitude` of the field. An error contains the settings that
/// would remedy it. A program translates them into its own names: a command-line program into
/// options, a dialogue into its input fields. Each module defines its settings in its
/// `settings.hpp`.
struct Setting {
  std::string_view path;  ///< points to a string literal

  friend constexpr bool operator==(Setting a, Setting b) { return a.path == b.path; }
};

}  // namespace axiscal
