// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "subcommand.hpp"

namespace axiscal::cli {

/// @return the action of the arguments: a subcommand, help or the version.
/// @throws UsageError  for an unknown subcommand, option or value, or one that is missing.
[[nodiscard]] Action parse_command_line(const std::vector<std::string>& arguments,
                                        std::span<const Subcommand> subcommands);

}  // namespace axiscal::cli
