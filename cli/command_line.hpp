// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "subcommand.hpp"

namespace axiscal::cli {

/// @return the action that the arguments request. It runs a subcommand, or prints the help or the
///         version.
/// @throws UsageError  if a subcommand, option or value is unknown or missing.
[[nodiscard]] Action parse_command_line(const std::vector<std::string>& arguments,
                                        std::span<const Subcommand> subcommands);

}  // namespace axiscal::cli
