// SPDX-License-Identifier: Apache-2.0
#include "command_line.hpp"

#include <algorithm>
#include <optional>
#include <string_view>

#include <CLI/CLI.hpp>

#include "axiscal/calib/choices.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/version.hpp"
#include "axiscal/core/worker_count.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/formulas/kind_file.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "core/formatted.hpp"
#include "definition.hpp"
#include "exchange_options.hpp"
#include "help.hpp"
#include "summary.hpp"
#include "typed_values.hpp"
#include "usage_error.hpp"
#include "version_text.hpp"

namespace axiscal::cli {
namespace {

// Returns the option of an argument "--option" or "--option=value"; null if it is unknown.
CLI::Option* find_option(CLI::App& app, const std::string& argument) {
  return app.get_option_no_throw(argument.substr(0, argument.find('=')));
}

constexpr std::string_view instrument_option = "--instrument";

// Returns FILE.json if the argument at this index is `--instrument FILE.json`; otherwise nullopt.
std::optional<std::string> instrument_file(const std::vector<std::string>& arguments,
                                           std::size_t at) {
  const std::string& argument = arguments[at];
  std::string value;
  if (argument == instrument_option && at + 1 < arguments.size()) {
    value = arguments[at + 1];
  } else if (argument.starts_with(formatted("{}=", instrument_option))) {
    value = argument.substr(instrument_option.size() + 1);
  }
  return value.ends_with(".json") ? std::optional(value) : std::nullopt;
}

// The options that every subcommand has.
struct CommonOptions {
  bool quiet = false;
  std::optional<std::string> jobs;
};

void add_common_options(const OptionSet& options, CommonOptions& common) {
  OptionSet group = options.group("Common");
  group.add_flag("--quiet", common.quiet, "print results and errors only");
  group.add("--jobs", common.jobs, "N", "number of threads [default: the number of processors]");
}

// Returns the names of all long options of a subcommand.
std::vector<std::string> all_names(const Subcommand& subcommand,
                                   const std::vector<std::string>& arguments) {
  CLI::App app;
  OptionSet options(app, arguments, Known::all);
  static_cast<void>(subcommand.define(options));
  CommonOptions common;
  add_common_options(options, common);
  std::vector<std::string> names;
  for (const CLI::Option* known : app.get_options()) {
    if (!known->get_lnames().empty()) {
      names.push_back("--" + known->get_lnames().front());
    }
  }
  return names;
}

// Joins each option and its value to one argument (--option=value), because a value may start with
// a minus sign. Refuses unknown options.
std::vector<std::string> with_joined_values(CLI::App& app,
                                            const Subcommand& subcommand,
                                            const std::vector<std::string>& arguments) {
  std::vector<std::string> result;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    std::string argument = arguments[i];
    if (argument.starts_with("--") && argument.size() > 2) {
      const CLI::Option* option = find_option(app, argument);
      if (const std::optional<std::string> file = instrument_file(arguments, i)) {
        // Every subcommand accepts the definition of an instrument kind, because a record can be
        // read only if its kind is known.
        const std::string_view kind = add_instrument_kind_file(*file).name;
        i += argument == instrument_option ? 1U : 0U;
        if (option != nullptr) {
          result.push_back(formatted("{}={}", instrument_option, kind));
        }
        continue;
      }
      if (option == nullptr) {
        const std::vector<std::string> names = all_names(subcommand, arguments);
        const std::vector<std::string_view> views(names.begin(), names.end());
        const std::string name = argument.substr(0, argument.find('='));
        throw UsageError(formatted("unknown option '{}'{}\n`axiscal {} --help` shows the options",
                                   name, did_you_mean(name, views), subcommand.name));
      }
      const bool takes_value = option->get_items_expected_min() > 0;
      const bool has_value = argument.find('=') != std::string::npos;
      const bool next_is_value =
          i + 1 < arguments.size() &&
          !(arguments[i + 1].starts_with("-") && find_option(app, arguments[i + 1]) != nullptr);
      if (takes_value && !has_value && next_is_value) {
        argument += "=" + arguments[++i];
      }
      if (takes_value && argument.ends_with("=")) {
        throw UsageError(argument.substr(0, argument.size() - 1) + ": its value is empty");
      }
    }
    if (argument == "-o" && i + 1 < arguments.size() && arguments[i + 1].empty()) {
      throw UsageError("-o: its value is empty");
    }
    result.push_back(argument);
  }
  return result;
}

// Returns the values that an option accepts, for shell completion; empty if any value is possible.
std::vector<std::string> values_of(const std::string& option) {
  std::vector<std::string> values;
  if (option == "--instrument") {
    for (const InstrumentKind& kind : instrument_kinds()) {
      values.emplace_back(kind.name);
    }
  } else if (option == "--field") {
    for (const FieldKind& kind : field_kinds()) {
      values.emplace_back(kind.name);
    }
  } else if (option == "--method") {
    for (const Method method : {Method::paired, Method::joint, Method::known, Method::magnitude,
                                Method::bias, Method::faces}) {
      values.emplace_back(method_name(method));
    }
  } else if (option == "--design") {
    values = {"6", "12", "24"};
  } else if (option == "--format") {
    values.assign(export_format_names.begin(), export_format_names.end());
  }
  return values;
}

OptionDefinition definition_of(const CLI::Option& option) {
  OptionDefinition definition{.names = {},
                              .type = "",
                              .help = option.get_description(),
                              .group = option.get_group(),
                              .is_argument = option.get_positional(),
                              .is_required = option.get_required()};
  for (const std::string& name : option.get_snames()) {
    definition.names.push_back("-" + name);
  }
  for (const std::string& name : option.get_lnames()) {
    definition.names.push_back("--" + name);
    definition.values = values_of(definition.names.back());
  }
  if (definition.is_argument) {
    definition.names = {option.get_single_name()};
  }
  if (option.get_items_expected_max() > 0) {
    definition.type = option.get_type_name();
  }
  return definition;
}

SubcommandDefinition definition_of_subcommand(const CLI::App& subcommand) {
  SubcommandDefinition definition{.name = subcommand.get_name(),
                                  .help = subcommand.get_description(),
                                  .examples = examples_of(subcommand.get_name()),
                                  .remarks = subcommand.get_footer(),
                                  .options = {}};
  for (const CLI::Option* option : subcommand.get_options()) {
    definition.options.push_back(definition_of(*option));
  }
  // Puts the arguments first. The options follow in the order of CLI11's groups.
  const std::vector<std::string> groups = subcommand.get_groups();
  std::stable_sort(definition.options.begin(), definition.options.end(),
                   [&](const OptionDefinition& a, const OptionDefinition& b) {
                     const auto rank = [&](const OptionDefinition& option) {
                       return std::pair(!option.is_argument,
                                        std::find(groups.begin(), groups.end(), option.group));
                     };
                     return rank(a) < rank(b);
                   });
  return definition;
}

ProgramDefinition definition_of(const CLI::App& app) {
  ProgramDefinition program{.name = app.get_name(),
                            .version = std::string(software_name()),
                            .help = app.get_description(),
                            .subcommands = {}};
  for (const CLI::App* subcommand : app.get_subcommands(nullptr)) {
    program.subcommands.push_back(definition_of_subcommand(*subcommand));
  }
  return program;
}

// Returns an action that prints a text, for example the help or the version.
Action show(std::string text) {
  return [text = std::move(text)] {
    write_whole_file("-", text);
    return 0;
  };
}

// Returns the action of `--generate KIND`, which prints the manual page, a completion or the page
// of options.
Action generate(const CLI::App& app, const std::vector<std::string>& arguments) {
  const std::string text =
      arguments.size() == 2 ? generated(definition_of(app), arguments[1]) : std::string();
  if (text.empty()) {
    throw UsageError("--generate: must be man, bash, zsh, fish or markdown");
  }
  return show(text);
}

// Converts `axiscal help calibrate` to `axiscal calibrate --help`.
std::vector<std::string> with_help_as_option(std::vector<std::string> arguments) {
  if (!arguments.empty() && arguments.front() == "help") {
    arguments.erase(arguments.begin());
    if (!arguments.empty() && arguments.front() == "help") {
      arguments.clear();
    }
    arguments.emplace_back("--help");
  }
  return arguments;
}

// Returns true if a word may be a request for help: `--help`, `--help-all`, `-h`.
bool asks_for_help(std::string_view word) {
  return word.starts_with("--help") || (word.starts_with('-') && !word.starts_with("--") &&
                                        word.find('h') != std::string_view::npos);
}

// Returns the message for words that CLI11 does not accept.
std::string message_of(const CLI::ParseError& error) {
  const std::string text = error.what();
  const auto name_before = [&](std::string_view words) { return text.substr(0, text.find(words)); };
  if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) {
    return name_before(" is required") + " is missing";
  }
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
    const std::size_t colon = text.find(": ");
    return formatted("unknown option or argument '{}'",
                     colon == std::string::npos ? text : text.substr(colon + 2));
  }
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
    return name_before(":") + (text.find("missing") != std::string::npos
                                   ? ": the value is missing"
                                   : ": give it only once, with one value");
  }
  return text;
}

[[noreturn]] void refuse_subcommand(std::span<const Subcommand> subcommands,
                                    const std::string& name) {
  std::vector<std::string_view> names;
  for (const Subcommand& subcommand : subcommands) {
    names.emplace_back(subcommand.name);
  }
  throw UsageError(formatted("unknown subcommand '{}'{}\n`axiscal help` lists the subcommands",
                             name, did_you_mean(name, names)));
}

}  // namespace

Action parse_command_line(const std::vector<std::string>& typed,
                          std::span<const Subcommand> subcommands) {
  const std::vector<std::string> arguments = with_help_as_option(typed);
  CLI::App app("Axiscal calibrates axis-sensitive instruments in 12 orientations.", "axiscal");
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string(software_name()), "Print the version and exit");
  bool is_verbose = false;
  app.add_flag("--verbose", is_verbose, "With --version: also print libraries and programs");
  const bool generates = !arguments.empty() && arguments.front() == "--generate";
  const bool shows_all =
      generates || std::any_of(arguments.begin(), arguments.end(), asks_for_help);
  CommonOptions common;
  CLI::App* named = nullptr;
  const Subcommand* asked = nullptr;
  Action action;
  for (const Subcommand& subcommand : subcommands) {
    CLI::App* parser = app.add_subcommand(subcommand.name, subcommand.help);
    parser->footer(subcommand.footer);
    const bool is_named = !arguments.empty() && arguments.front() == subcommand.name;
    if (is_named || generates) {  // registering all options takes longer than most runs
      OptionSet options(*parser, arguments, shows_all ? Known::all : Known::typed);
      action = subcommand.define(options);
      add_common_options(options, common);
    }
    named = is_named ? parser : named;
    asked = is_named ? &subcommand : asked;
  }

  if (arguments.empty()) {
    throw UsageError("a subcommand is missing\n\n" + overview(definition_of(app)));
  }
  if (generates) {
    return generate(app, arguments);
  }
  if (named == nullptr && !arguments.front().starts_with("-")) {
    refuse_subcommand(subcommands, arguments.front());
  }
  if (std::find(arguments.begin(), arguments.end(), "--help-all") != arguments.end()) {
    return show(named != nullptr ? full_help(definition_of_subcommand(*named))
                                 : overview(definition_of(app)));
  }
  try {
    std::vector<std::string> words =
        named != nullptr ? with_joined_values(*named, *asked, arguments) : arguments;
    std::reverse(words.begin(), words.end());  // CLI11 expects the reverse order
    app.parse(words);
  } catch (const CLI::CallForHelp&) {
    return show(named != nullptr ? short_help(definition_of_subcommand(*named))
                                 : overview(definition_of(app)));
  } catch (const CLI::CallForVersion&) {
    const bool asks_for_all =
        std::find(arguments.begin(), arguments.end(), "--verbose") != arguments.end();
    return show(asks_for_all ? verbose_version(subcommands) : std::string(software_name()) + "\n");
  } catch (const CLI::ParseError& error) {
    if (named != nullptr) {
      throw UsageError(formatted("{}\n`axiscal {} --help` shows the options", message_of(error),
                                 arguments.front()));
    }
    // The command line contains options, but no subcommand. The code below reports this.
  }
  set_quiet(common.quiet);
  if (common.jobs) {
    set_worker_count(static_cast<std::size_t>(parse_whole_number("--jobs", *common.jobs, 1)));
  }
  if (named == nullptr) {
    throw UsageError(formatted("a subcommand must come before '{}'\n\n{}", arguments.front(),
                               overview(definition_of(app))));
  }
  return action;
}

}  // namespace axiscal::cli
