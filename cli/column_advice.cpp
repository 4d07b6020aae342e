// SPDX-License-Identifier: Apache-2.0
#include "column_advice.hpp"

#include <algorithm>
#include <cctype>
#include <vector>

#include "axiscal/core/formatted.hpp"

namespace axiscal::cli {
namespace {

std::string in_small_letters(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// The names that come of another letter for the one at a place, where the table has all three.
std::string three_columns(const std::vector<std::string>& columns,
                          const std::string& first,
                          std::size_t place) {
  std::string list = first;
  const bool is_small = first[place] == 'x';
  for (const char letter : {'y', 'z'}) {
    std::string other = first;
    other[place] = is_small ? letter : static_cast<char>(std::toupper(letter));
    if (std::find(columns.begin(), columns.end(), other) == columns.end()) {
      return "";
    }
    list += "," + other;
  }
  return list;
}

}  // namespace

std::string column_advice(const MissingColumnError& error,
                          std::string_view option,
                          std::string_view word) {
  std::string any;
  for (const std::string& name : error.columns()) {
    for (std::size_t place = 0; place < name.size(); ++place) {
      if (name[place] != 'x' && name[place] != 'X') {
        continue;
      }
      const std::string three = three_columns(error.columns(), name, place);
      if (three.empty()) {
        continue;
      }
      const bool has_word = !word.empty() && in_small_letters(name).find(word) != std::string::npos;
      any = any.empty() || has_word ? three : any;
      if (has_word) {
        break;
      }
    }
  }
  const bool needs_quotes = any.find_first_of(" ()[];") != std::string::npos;
  return any.empty() ? ""
                     : formatted("; try {} {}{}{}", option, needs_quotes ? "\"" : "", any,
                                 needs_quotes ? "\"" : "");
}

}  // namespace axiscal::cli
