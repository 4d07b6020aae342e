// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/printable_text.hpp"

#include <algorithm>
#include <array>

#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the number of bytes of the control character at position i; 0 if another character is
// there.
std::size_t control_at(std::string_view text, std::size_t i) {
  const auto byte = static_cast<unsigned char>(text[i]);
  if (byte < 0x20 || byte == 0x7F) {
    return 1;
  }
  const bool is_second = i + 1 < text.size() && byte == 0xC2 &&
                         (static_cast<unsigned char>(text[i + 1]) & 0xE0U) == 0x80;
  if (is_second) {  // U+0080 to U+009F
    return 2;
  }
  return 0;
}

std::string with_controls_shown(std::string_view text, std::string_view but) {
  std::string shown;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t size = control_at(text, i);
    if (size == 0 || but.find(text[i]) != std::string_view::npos) {
      shown += text[i++];
      continue;
    }
    shown += formatted("\\x{:02X}",
                       static_cast<unsigned>(static_cast<unsigned char>(text[i + size - 1])));
    i += size;
  }
  return shown;
}

}  // namespace

std::string printable_text(std::string_view text) {
  return with_controls_shown(text, "\t\n");
}

std::string printable_name(std::string_view name) {
  return with_controls_shown(name, "");
}

bool is_formula(std::string_view cell) {
  constexpr std::string_view beginnings = "=+-@\t\r";
  if (cell.empty() || beginnings.find(cell.front()) == std::string_view::npos) {
    return false;
  }
  const bool is_face =
      cell.size() == 2 && std::string_view("xyzXYZ").find(cell[1]) != std::string_view::npos;
  const std::string_view behind = cell.substr(1);
  constexpr std::array<std::string_view, 5> no_numbers = {"", "nan", "NaN", "inf", "Inf"};
  const bool says_none =
      std::find(no_numbers.begin(), no_numbers.end(), behind) != no_numbers.end();
  return !is_face && !says_none && !parse_number(cell.substr(cell.front() == '+' ? 1 : 0));
}

std::string formula_safe_cell(const std::string& word) {
  return csv_cell(is_formula(word) ? "'" + word : word);
}

}  // namespace axiscal
