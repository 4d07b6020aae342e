// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>
#include <optional>

#include "axiscal/core/number_text.hpp"
#include "line_stream.hpp"
#include "opened.hpp"
#include "text_layout.hpp"

namespace axiscal {
namespace {

// "X: 1.5 Y: -2 Z: 3": names and numbers in turn.
bool read_pairs(std::string_view line,
                std::vector<std::string>& names,
                std::vector<double>& values) {
  names.clear();
  values.clear();
  std::size_t at = 0;
  constexpr std::string_view blanks = " \t,;|";
  for (;;) {
    at = line.find_first_not_of(blanks, at);
    if (at == std::string_view::npos) {
      return !names.empty();
    }
    const std::size_t mark = line.find_first_of(":=", at);
    if (mark == std::string_view::npos) {
      // What follows a number may be its unit: "X: 1.5 uT".
      return names.size() >= 2 &&
             std::none_of(line.begin() + static_cast<std::ptrdiff_t>(at), line.end(),
                          [](unsigned char c) { return std::isdigit(c) != 0; });
    }
    std::string_view name = trimmed(line.substr(at, mark - at));
    if (!names.empty() && name.find(' ') != std::string_view::npos) {
      name = trimmed(name.substr(name.rfind(' ')));  // a unit before it
    }
    if (name.empty() || std::isalpha(static_cast<unsigned char>(name.front())) == 0) {
      return false;
    }
    const std::size_t first = line.find_first_not_of(" \t", mark + 1);
    if (first == std::string_view::npos) {
      return false;
    }
    const std::size_t end = std::min(line.find_first_of(" \t,;|", first), line.size());
    const std::optional<double> value = parse_number(line.substr(first, end - first));
    if (!value) {
      return false;
    }
    names.emplace_back(name);
    values.push_back(*value);
    at = end;
  }
}

constexpr std::string_view arrow = " -> ";

ByteSource without_arrows(ByteSource bytes) {
  return converted_lines(std::move(bytes), [](std::string_view line, std::string& text) {
    const std::size_t at = line.find(arrow);
    if (at != std::string_view::npos && at + arrow.size() < line.size()) {
      const std::string_view rest = trimmed(line.substr(at + arrow.size()));
      const char delimiter = rest.find(',') != std::string_view::npos    ? ','
                             : rest.find('\t') != std::string_view::npos ? '\t'
                             : rest.find(';') != std::string_view::npos  ? ';'
                                                                         : ' ';
      text = std::string(trimmed(line.substr(0, at))) + delimiter + std::string(rest);
    }
    text += '\n';
  });
}

// Stamped pairs: "14:08:06.818 -> X: 1 Y: 2".
std::string_view behind_arrow(std::string_view line) {
  const std::size_t at = line.find(arrow);
  return at == std::string_view::npos ? line : line.substr(at + arrow.size());
}

ByteSource pairs_as_table(ByteSource bytes) {
  return converted_lines(
      std::move(bytes),
      [header = std::vector<std::string>(), has_header = false, names = std::vector<std::string>(),
       values = std::vector<double>()](std::string_view line, std::string& text) mutable {
        const std::size_t at = line.find(arrow);
        const bool has_stamp = at != std::string_view::npos;
        const bool are_pairs = read_pairs(behind_arrow(line), names, values);
        if (are_pairs && !has_header && names.size() >= 2) {
          header = names;
          has_header = true;
          text = (has_stamp ? "time," : "") + joined(header, ",") + '\n';
        }
        if (are_pairs && names == header) {
          if (has_stamp) {
            text += std::string(trimmed(line.substr(0, at))) + ',';
          }
          for (std::size_t i = 0; i < values.size(); ++i) {
            text += (i > 0 ? "," : "") + number_text(values[i]);
          }
        }
        text += '\n';
      });
}

}  // namespace

ByteSource printed_lines_as_table(ByteSource bytes) {
  constexpr std::size_t looked_at = 8192;
  const std::string_view start = bytes.peek(looked_at);
  const bool are_pairs = are_most_lines(start, [](std::string_view line) {
    std::vector<std::string> names;
    std::vector<double> values;
    return read_pairs(behind_arrow(line), names, values) && names.size() >= 2;
  });
  if (are_pairs) {
    return pairs_as_table(std::move(bytes));
  }
  const bool are_stamped = are_most_lines(start, [](std::string_view line) {
    const std::size_t at = line.find(arrow);
    return at != std::string_view::npos && !std::isnan(clock_seconds(trimmed(line.substr(0, at))));
  });
  return are_stamped ? without_arrows(std::move(bytes)) : std::move(bytes);
}

}  // namespace axiscal
