// SPDX-License-Identifier: Apache-2.0
#include "column_advice.hpp"

#include <algorithm>
#include <cctype>
#include <vector>

#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "axiscal/logs/table_text.hpp"
#include "core/formatted.hpp"

namespace axiscal::cli {
namespace {

// Returns the columns of the three axes, for example "acc_x,acc_y,acc_z". The result is empty if
// the table lacks one of them.
// @param first  name of the column of axis x.
// @param place  index of the letter x in `first`.
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
      const bool has_word = !word.empty() && to_lower_case(name).find(word) != std::string::npos;
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

std::string with_marked_cell(const std::string& message) {
  // Finds the colon after PATH in a message PATH:LINE: column 'NAME': ...
  std::size_t colon = message.find(':');
  while (colon != std::string::npos) {
    const std::size_t end = message.find_first_not_of("0123456789", colon + 1);
    if (end != std::string::npos && end > colon + 1 && message.compare(end, 2, ": ") == 0) {
      break;
    }
    colon = message.find(':', colon + 1);
  }
  if (colon == std::string::npos) {
    return message;
  }
  const std::string path = message.substr(0, colon);
  const std::size_t end = message.find(':', colon + 1);
  constexpr std::string_view head = ": column '";
  if (message.compare(end, head.size(), head) != 0 || !can_be_read_again(path)) {
    return message;
  }
  const std::size_t quote = message.find('\'', end + head.size());
  const std::string column = message.substr(end + head.size(), quote - end - head.size());
  const auto line = static_cast<std::size_t>(
      parse_number(message.substr(colon + 1, end - colon - 1)).value_or(0.0));
  const std::string excerpt = line > 0 ? marked_cell(path, line, column) : "";
  return excerpt.empty() ? message : message + "\n" + excerpt;
}

}  // namespace axiscal::cli
