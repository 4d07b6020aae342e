// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace axiscal::cli {

/// Whether an argument or option must be given.
enum class Need { optional, required };

/// The options that are registered with the parser: all options, or only those that the command
/// line contains (`typed`). Registering all options takes longer than most subcommands run.
/// Arguments and required options are always registered.
enum class Known : std::uint8_t { all, typed };

/// Registers the arguments and options of a subcommand with the parser.
///
/// Values are stored as strings, and the code that uses a value checks it. A name without dashes
/// denotes an argument. The variables for the values must outlive the parsing.
class OptionSet {
 public:
  /// @param typed  the whole command line, which must outlive this object.
  OptionSet(CLI::App& app, const std::vector<std::string>& typed, Known known);

  /// @return the same set with another heading. In the help, options that are added to the result
  ///         appear under this heading.
  [[nodiscard]] OptionSet group(const char* heading) const;

  /// @param type  type of the value, as the help shows it, for example "FILE" or "DEG".
  void add(const char* name, std::optional<std::string>& value, const char* type, const char* help);
  void add(const char* name,
           std::string& value,
           const char* type,
           const char* help,
           Need need = Need::optional);
  /// Adds an option or argument that takes one or more values.
  void add(const char* name,
           std::vector<std::string>& values,
           const char* type,
           const char* help,
           Need need = Need::optional);
  /// Adds a required option with one value. The option may be given several times.
  void add_repeated(const char* name,
                    std::vector<std::string>& values,
                    const char* type,
                    const char* help);
  void add_flag(const char* name, bool& value, const char* help);
  /// Adds `-o,--output`, whose default is standard output.
  void add_output(std::string& path, const char* help = "output file; - is stdout [default: -]");

  /// @return the whole command line.
  [[nodiscard]] const std::vector<std::string>& typed() const { return *typed_; }

 private:
  CLI::Option& finished(CLI::Option& option, const char* type);

  // @param names  names of the option, separated by a comma as for add(): "-o,--output".
  [[nodiscard]] bool is_wanted(std::string_view names, Need need = Need::optional) const;

  CLI::App* app_;
  const std::vector<std::string>* typed_;
  Known known_;
  std::string heading_;
};

}  // namespace axiscal::cli
