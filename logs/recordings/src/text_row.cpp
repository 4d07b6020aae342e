// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/text_row.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <string>

#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"

namespace axiscal {

std::string_view without_checksum(std::string_view line) {
  const auto is_hex = [](char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; };
  const std::size_t n = line.size();
  const bool has = n > 3 && line[n - 3] == '*' && is_hex(line[n - 2]) && is_hex(line[n - 1]);
  return has ? line.substr(0, n - 3) : line;
}

namespace {

std::string_view without_quotes(std::string_view cell) {
  const bool quoted = cell.size() > 1 && cell.front() == cell.back() &&
                      (cell.front() == '"' || cell.front() == '\'');
  return quoted ? cell.substr(1, cell.size() - 2) : cell;
}

// Splits a line in which delimiters within quotes are text.
std::vector<std::string_view> quoted_cells_of(std::string_view line, char delimiter) {
  std::vector<std::string_view> cells;
  const auto parts = [&](char c) {
    return delimiter == ' ' ? c == ' ' || c == '\t' || c == '\r' : c == delimiter;
  };
  bool inside = false;
  std::size_t first = 0;
  const auto end_cell = [&](std::size_t end) {
    const std::string_view cell = trimmed(line.substr(first, end - first));
    if (delimiter != ' ' || !cell.empty()) {
      cells.push_back(cell);
    }
  };
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') {
      inside = !inside;
    } else if (!inside && parts(line[i])) {
      end_cell(i);
      first = i + 1;
    }
  }
  end_cell(line.size());
  return cells;
}

}  // namespace

std::vector<std::string_view> cells_of(std::string_view line, char delimiter) {
  std::vector<std::string_view> cells;
  if (line.find('"') != std::string_view::npos) {
    return quoted_cells_of(line, delimiter);
  }
  if (delimiter != ' ') {
    for (const std::string_view cell : split(line, delimiter)) {
      cells.push_back(trimmed(cell));
    }
    return cells;
  }
  std::size_t at = line.find_first_not_of(" \t\r");
  while (at != std::string_view::npos) {
    const std::size_t end = line.find_first_of(" \t\r", at);
    cells.push_back(line.substr(at, end == std::string_view::npos ? end : end - at));
    at = end == std::string_view::npos ? end : line.find_first_not_of(" \t\r", end);
  }
  return cells;
}

double cell_number(std::string_view cell, bool decimal_comma) {
  std::array<char, 64> copy{};
  if (decimal_comma && cell.size() < copy.size()) {
    std::replace_copy(cell.begin(), cell.end(), copy.begin(), ',', '.');
    cell = std::string_view(copy.data(), cell.size());
  }
  return parse_number(without_quotes(cell)).value_or(not_a_number);
}

bool is_missing(std::string_view cell) {
  constexpr std::array<std::string_view, 14> words = {
      "", "nan", "inf", "-inf", "null", "none", "nil", "na", "n/a", "#n/a", "-", "--", "?", "-nan"};
  std::string small(trimmed(without_quotes(cell)));
  std::transform(small.begin(), small.end(), small.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(words.begin(), words.end(), small) != words.end();
}

DecoratedNumber parse_decorated_number(std::string_view cell, bool decimal_comma) {
  const DecoratedNumber none{.value = not_a_number, .unit = {}, .is_grouped = false};
  cell = trimmed(without_quotes(trimmed(cell)));
  const std::size_t end = std::min(cell.find_first_not_of("+-0123456789.,'eE"), cell.size());
  std::string_view number = trimmed(cell.substr(0, end));
  std::string_view unit = trimmed(cell.substr(end));
  if (!number.empty() && (number.back() == 'e' || number.back() == 'E')) {
    return none;
  }
  const char point = decimal_comma ? ',' : '.';
  const std::string_view groups = decimal_comma ? ".'" : ",'";
  const std::size_t whole_end = std::min(number.find(point), number.size());
  std::string plain;
  bool is_grouped = false;
  std::size_t digits = 0;  // digits since the last thousands separator
  for (std::size_t i = 0; i < whole_end; ++i) {
    const char c = number[i];
    if (groups.find(c) != std::string_view::npos) {
      constexpr std::size_t digits_of_group = 3;
      const bool is_first = !is_grouped;
      if (digits == 0 || digits > digits_of_group || (!is_first && digits != digits_of_group) ||
          (is_first && plain.back() == '0' && digits == 1)) {
        return none;
      }
      is_grouped = true;
      digits = 0;
    } else {
      plain += c;
      digits += c >= '0' && c <= '9' ? 1U : 0U;
    }
  }
  constexpr std::size_t digits_of_group = 3;
  if (is_grouped && digits != digits_of_group) {
    return none;
  }
  if (whole_end < number.size()) {
    plain += '.';
    plain += number.substr(whole_end + 1);
  }
  const std::optional<double> value = parse_number(plain);
  return value ? DecoratedNumber{.value = *value, .unit = unit, .is_grouped = is_grouped} : none;
}

std::string_view cell_name(std::string_view cell) {
  return trimmed(without_quotes(cell));
}

bool is_comment_line(std::string_view line) {
  const std::string_view text = trimmed(line);
  return text.empty() || text.front() == '#' || text.front() == '%' || text.starts_with("//");
}

}  // namespace axiscal
