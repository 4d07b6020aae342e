// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axiscal::cli {

/// The definition of one option or argument, for the help.
struct OptionDefinition {
  std::vector<std::string> names;  ///< such as "-o", "--output"; an argument has no dashes
  std::string type;                ///< type of the value, such as "DEG"; empty for a flag
  std::string help;
  std::string group;         ///< heading under which the help lists the option
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
/// @return the text of the manual page, of a shell's completion, or of the page of options; empty
///         if the kind is unknown.
[[nodiscard]] std::string generated(const ProgramDefinition& program, std::string_view kind);

}  // namespace axiscal::cli
