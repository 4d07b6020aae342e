// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "definition.hpp"

namespace axiscal::cli {

/// @return three examples of a subcommand's command line; empty if the subcommand is unknown.
[[nodiscard]] std::vector<std::string> examples_of(const std::string& subcommand);

/// @return the list of the subcommands, in at most 23 lines of 80 columns.
[[nodiscard]] std::string overview(const ProgramDefinition& program);

/// @return the short help: examples, and the options that most calls need. Each option has only the
///         first clause of its description. The text has at most 24 lines of 80 columns.
[[nodiscard]] std::string short_help(const SubcommandDefinition& subcommand);

/// @return the full help: examples, and all options with their whole descriptions, in lines of 80
///         columns.
[[nodiscard]] std::string full_help(const SubcommandDefinition& subcommand);

}  // namespace axiscal::cli
