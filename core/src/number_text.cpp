// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/number_text.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "core/formatted.hpp"
#include "core/read_double.hpp"

namespace axiscal {
namespace {

std::from_chars_result read(const char* first, const char* last, double& value) noexcept {
  return read_double(first, last, value);
}

std::from_chars_result read(const char* first, const char* last, int& value) noexcept {
  return std::from_chars(first, last, value);
}

template <typename Number>
std::optional<Number> parse_whole(std::string_view text) noexcept {
  // The plus sign is removed because read() does not accept it. "+-1" must remain an error.
  if (text.size() > 1 && text.front() == '+' && text[1] != '-') {
    text.remove_prefix(1);
  }
  Number value{};
  const auto [end, error] = read(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) {
    return std::nullopt;
  }
  return value;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) noexcept {
  const std::optional<double> value = parse_whole<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<int> parse_integer(std::string_view text) noexcept {
  return parse_whole<int>(text);
}

std::optional<std::vector<double>> parse_numbers(std::string_view text) {
  std::vector<double> numbers;
  for (const std::string_view part : split(text, ',')) {
    const std::optional<double> number = parse_number(part);
    if (!number) {
      return std::nullopt;
    }
    numbers.push_back(*number);
  }
  return numbers;
}

char* write_decimals(char* first, double value, int decimals) noexcept {
  static constexpr std::array powers = {1.0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                        1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  constexpr double exact_below = 9e15;
  const double units = std::round(value * powers[static_cast<std::size_t>(decimals)]);
  if (!(std::abs(units) < exact_below)) {
    return write_number(first, value);
  }
  if (units < 0.0) {
    *first++ = '-';
  }
  // Collects the digits from the last to the first, with at least one before the decimal point.
  std::array<char, number_text_size> digits{};
  auto left = static_cast<std::uint64_t>(std::abs(units));
  int count = 0;
  do {
    digits[static_cast<std::size_t>(count++)] = static_cast<char>('0' + left % 10);
    left /= 10;
  } while (left > 0 || count <= decimals);
  while (count > 0) {
    *first++ = digits[static_cast<std::size_t>(--count)];
    if (count == decimals && decimals > 0) {
      *first++ = '.';
    }
  }
  return first;
}

std::string number_text(double value) {
  std::array<char, number_text_size> text{};
  return {text.data(), write_number(text.data(), value)};
}

std::string number_text(double value, int digits) {
  std::array<char, 64> text{};
  const std::to_chars_result result = std::to_chars(text.data(), text.data() + text.size(), value,
                                                    std::chars_format::general, digits);
  return {text.data(), result.ptr};
}

std::string unit_per(const std::string& unit, const std::string& other) {
  if (other == "1") {
    return unit;
  }
  return formatted("{}/{}", unit,
                   other.find('/') == std::string::npos ? other : formatted("({})", other));
}

std::string_view without_returns(std::string_view line) noexcept {
  while (line.ends_with('\r')) {
    line.remove_suffix(1);
  }
  while (line.starts_with('\r')) {
    line.remove_prefix(1);
  }
  return line;
}

std::string_view trimmed(std::string_view text) noexcept {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) {
    text.remove_prefix(1);
  }
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) {
    text.remove_suffix(1);
  }
  return text;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(separator);
    parts.push_back(trimmed(text.substr(0, end)));
    if (end == std::string_view::npos) {
      return parts;
    }
    text.remove_prefix(end + 1);
  }
}

std::string joined(const std::vector<std::string>& parts, std::string_view separator) {
  std::string text;
  for (const std::string& part : parts) {
    if (!text.empty()) {
      text += separator;
    }
    text += part;
  }
  return text;
}

}  // namespace axiscal
