// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include "core/own_program.hpp"
#include "option_set.hpp"

namespace axiscal::cli {

/// The work of a command line. It returns the exit status and throws errors.
using Action = std::function<int()>;

/// A subcommand as it defines itself.
struct Subcommand {
  const char* name;
  const char* help;
  const char* footer;  ///< ends its help: examples
  /// Registers the options. The returned action runs after they are parsed.
  std::function<Action(OptionSet& options)> define;
  OwnProgram program = {};  ///< that does the work; without a name: this one
};

/// @param add_options  registers the options of a Command.
/// @param run          does what a Command asks for.
template <class Command>
Subcommand make_subcommand(const char* name,
                           const char* help,
                           const char* footer,
                           void (*add_options)(OptionSet& options, Command& command),
                           int (*run)(const Command& command)) {
  return {name,
          help,
          footer,
          [=](OptionSet& options) -> Action {
            const auto command = std::make_shared<Command>();
            add_options(options, *command);
            return [command, run] { return run(*command); };
          },
          {}};
}

}  // namespace axiscal::cli
