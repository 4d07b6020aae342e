// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axiscal::cli {

/// The definition of one option or argument, for the help.
struct OptionDefinition {
  std::vector<std::string> names;  ///< "--output", "-o"; an argument's name has no dashes
  std::string type;                ///< type of its value: "FILE", "DEG"; empty for a flag
  std::string help;
  std::string group;         ///< heading under which the help shows it
  bool is_argument = false;  ///< true: a positional argument
  bool is_required = false;
  std::vector<std::string> values = {};  ///< values that completion proposes
};

struct SubcommandDefinition {
  std::string name;
  std::string help;
  std::vector<std::string> examples;  ///< command lines
  std::string remarks;                ///< text at the end of the full help
  std::vector<OptionDefinition> options;
};

/// The definition of the command, from which the manual page and the completions are generated.
struct ProgramDefinition {
  std::string name;
  std::string version;
  std::string help;
  std::vector<SubcommandDefinition> subcommands;
};

/// @param kind  argument of `axiscal --generate`: "man", "bash", "zsh", "fish", "markdown".
/// @return the manual page, a completion, or the documentation's page of options; empty if the kind
///         is unknown.
[[nodiscard]] std::string generated(const ProgramDefinition& program, std::string_view kind);

}  // namespace axiscal::cli
