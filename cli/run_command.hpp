// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "subcommand.hpp"

namespace axiscal::cli {

/// Runs the command `axiscal ARGUMENT..`. Messages are printed on stderr.
/// @param subcommands  the subcommands in the order in which the help lists them.
/// @return the exit status; docs/messages.md lists the values.
[[nodiscard]] int run_command(const std::vector<std::string>& arguments,
                              const std::vector<Subcommand>& subcommands);

/// The main function of `axiscal` and of the other programs.
[[nodiscard]] int run_main(int count, char** arguments, const std::vector<Subcommand>& subcommands);

}  // namespace axiscal::cli
