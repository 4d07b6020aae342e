// SPDX-License-Identifier: Apache-2.0
#include "option_set.hpp"

#include <algorithm>

#include <CLI/CLI.hpp>

namespace axiscal::cli {
namespace {

// Returns true if an argument names `option` in one of the forms `--output`, `--output=FILE`, `-o`,
// `-oFILE`.
bool names_option(std::string_view word, std::string_view option) {
  if (option.starts_with("--")) {
    return word.starts_with(option) && (word.size() == option.size() || word[option.size()] == '=');
  }
  return word.size() > 1 && word[0] == '-' && word[1] != '-' &&
         word.find(option.back()) != std::string_view::npos;
}

}  // namespace

OptionSet::OptionSet(CLI::App& app, const std::vector<std::string>& typed, Known known)
    : app_(&app), typed_(&typed), known_(known) {}

bool OptionSet::is_wanted(std::string_view names, Need need) const {
  if (known_ == Known::all || need == Need::required || !names.starts_with('-')) {
    return true;
  }
  while (!names.empty()) {
    const std::string_view option = names.substr(0, names.find(','));
    names.remove_prefix(std::min(names.size(), option.size() + 1));
    if (std::any_of(typed_->begin(), typed_->end(),
                    [&](const std::string& word) { return names_option(word, option); })) {
      return true;
    }
  }
  return false;
}

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
  if (is_wanted(name)) {
    finished(*app_->add_option(name, value, help), type);
  }
}

void OptionSet::add(
    const char* name, std::string& value, const char* type, const char* help, Need need) {
  if (is_wanted(name, need)) {
    finished(*app_->add_option(name, value, help), type).required(need == Need::required);
  }
}

void OptionSet::add(const char* name,
                    std::vector<std::string>& values,
                    const char* type,
                    const char* help,
                    Need need) {
  if (is_wanted(name, need)) {
    finished(*app_->add_option(name, values, help), type).required(need == Need::required);
  }
}

void OptionSet::add_repeated(const char* name,
                             std::vector<std::string>& values,
                             const char* type,
                             const char* help) {
  finished(*app_->add_option(name, values, help), type).required()->take_all()->expected(1);
}

void OptionSet::add_flag(const char* name, bool& value, const char* help) {
  if (is_wanted(name)) {
    finished(*app_->add_flag(name, value, help), nullptr);
  }
}

void OptionSet::add_output(std::string& path, const char* help) {
  add("-o,--output", path, "FILE", help);
}

}  // namespace axiscal::cli
