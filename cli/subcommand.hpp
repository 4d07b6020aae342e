// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include "core/own_program.hpp"
#include "option_set.hpp"

namespace axiscal::cli {

/// A function that does the work of a command line. It returns the exit status, or throws an error.
using Action = std::function<int()>;

/// The definition of a subcommand.
struct Subcommand {
  const char* name;
  const char* help;
  const char* footer;  ///< text at the end of the subcommand's full help
  /// Registers the options. The returned action runs after they are parsed.
  std::function<Action(OptionSet& options)> define;
  /// Other program that runs the subcommand; if its name is empty, this program runs it.
  OwnProgram program = {};
};

/// @param add_options  function that registers the options of a Command.
/// @param run          function that runs the subcommand with the options in a Command.
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
