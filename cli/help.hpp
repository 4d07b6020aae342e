// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace CLI {
class App;
}  // namespace CLI

namespace axiscal::cli {

/// @return three ways to call a subcommand, one a line; empty for a name that is none.
[[nodiscard]] std::string examples_of(const std::string& subcommand);

/// @return the help of a subcommand: the common options, its examples, and the number of further
///         options; or all options.
[[nodiscard]] std::string help_of(CLI::App& subcommand, bool all);

}  // namespace axiscal::cli
