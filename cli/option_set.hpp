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

/// Whether a subcommand does without an argument or option.
enum class Need { optional, required };

/// Which options are known to the parser: to register all costs more than most of what a run does.
/// Arguments and what is required always are.
enum class Known : std::uint8_t { all, typed };

/// The arguments and options of a subcommand, while it registers them.
///
/// Values are kept as typed: whoever uses one says what is wrong with it. A name without dashes is
/// an argument. What values are put into must outlive the parsing.
class OptionSet {
 public:
  /// @param typed  the whole command line.
  OptionSet(CLI::App& app, const std::vector<std::string>& typed, Known known);

  /// @return the same set; what is added to it stands under this heading of the help.
  [[nodiscard]] OptionSet group(const char* heading) const;

  /// @param type  of the value, as help shows it: "FILE", "DEG".
  void add(const char* name, std::optional<std::string>& value, const char* type, const char* help);
  void add(const char* name,
           std::string& value,
           const char* type,
           const char* help,
           Need need = Need::optional);
  /// One value or more.
  void add(const char* name,
           std::vector<std::string>& values,
           const char* type,
           const char* help,
           Need need = Need::optional);
  /// Given once or more often, with one value each time.
  void add_repeated(const char* name,
                    std::vector<std::string>& values,
                    const char* type,
                    const char* help);
  void add_flag(const char* name, bool& value, const char* help);
  /// `-o`, standard output where it is not given.
  void add_output(std::string& path, const char* help = "where to write; - is stdout");

  /// The whole command line, as typed.
  [[nodiscard]] const std::vector<std::string>& typed() const { return *typed_; }

 private:
  CLI::Option& finished(CLI::Option& option, const char* type);

  // @param names  as add() takes them: "-o,--output".
  [[nodiscard]] bool is_wanted(std::string_view names, Need need = Need::optional) const;

  CLI::App* app_;
  const std::vector<std::string>* typed_;
  Known known_;
  std::string heading_;
};

}  // namespace axiscal::cli
