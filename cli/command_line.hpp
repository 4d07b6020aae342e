// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "subcommand.hpp"

namespace axiscal::cli {

/// @return what the arguments ask for, to be run: one of the subcommands, help or the version.
/// @throws UsageError  for an unknown subcommand, option or value, or one that is missing.
[[nodiscard]] Action parse_command_line(const std::vector<std::string>& arguments,
                                        std::span<const Subcommand> subcommands);

}  // namespace axiscal::cli
