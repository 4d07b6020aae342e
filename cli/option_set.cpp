// SPDX-License-Identifier: Apache-2.0
#include "option_set.hpp"

#include <CLI/CLI.hpp>

namespace axiscal::cli {

OptionSet::OptionSet(CLI::App& app, const std::vector<std::string>& typed)
    : app_(&app), typed_(&typed) {}

OptionSet OptionSet::group(const char* heading) const {
  OptionSet group = *this;
  group.heading_ = heading;
  return group;
}

CLI::Option& OptionSet::finished(CLI::Option& option, const char* type) {
  if (type != nullptr) {
    option.type_name(type);
  }
  if (!heading_.empty()) {
    option.group(heading_);
  }
  return option;
}

void OptionSet::add(const char* name,
                    std::optional<std::string>& value,
                    const char* type,
                    const char* help) {
  finished(*app_->add_option(name, value, help), type);
}

void OptionSet::add(
    const char* name, std::string& value, const char* type, const char* help, Need need) {
  finished(*app_->add_option(name, value, help), type).required(need == Need::required);
}

void OptionSet::add(const char* name,
                    std::vector<std::string>& values,
                    const char* type,
                    const char* help,
                    Need need) {
  finished(*app_->add_option(name, values, help), type).required(need == Need::required);
}

void OptionSet::add_repeated(const char* name,
                             std::vector<std::string>& values,
                             const char* type,
                             const char* help) {
  finished(*app_->add_option(name, values, help), type).required()->take_all()->expected(1);
}

void OptionSet::add_flag(const char* name, bool& value, const char* help) {
  finished(*app_->add_flag(name, value, help), nullptr);
}

void OptionSet::add_output(std::string& path, const char* help) {
  add("-o,--output", path, "FILE", help);
}

}  // namespace axiscal::cli
