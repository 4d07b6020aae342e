// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include "core/own_program.hpp"
#include "option_set.hpp"

namespace axiscal::cli {

/// What the command line asks for; it returns the exit status, errors are thrown.
using Action = std::function<int()>;

/// A subcommand as it defines itself.
struct Subcommand {
  const char* name;
  const char* help;
  const char* footer;  ///< ends its help: examples
  /// Registers the options; what it returns is run once they are read.
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
