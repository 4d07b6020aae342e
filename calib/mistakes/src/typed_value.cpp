// SPDX-License-Identifier: Apache-2.0
#include "calib/mistakes/src/typed_value.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "axiscal/core/number_text.hpp"

namespace axiscal {

std::optional<double> infer_intended_value(double typed, double expected, double tolerance) {
  const std::string text = number_text(typed);
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  constexpr std::ptrdiff_t fewest_digits = 4;
  if (!std::isfinite(typed) || text.find('e') != std::string::npos ||
      std::count_if(text.begin(), text.end(), is_digit) < fewest_digits) {
    return std::nullopt;
  }
  std::vector<double> slips = {-typed, 10.0 * typed, typed / 10.0, 100.0 * typed, typed / 100.0};
  const auto add = [&](const std::string& other) {
    if (const std::optional<double> value = parse_number(other)) {
      slips.push_back(*value);
    }
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (!is_digit(text[i])) {
      continue;
    }
    for (char digit = '0'; digit <= '9'; ++digit) {
      std::string other = text;
      other[i] = digit;
      add(other);
    }
    if (i + 1 < text.size() && is_digit(text[i + 1])) {
      std::string other = text;
      std::swap(other[i], other[i + 1]);
      add(other);
    }
  }
  const auto nearest = std::min_element(slips.begin(), slips.end(), [&](double a, double b) {
    return std::abs(a - expected) < std::abs(b - expected);
  });
  return std::abs(*nearest - expected) <= tolerance ? std::optional(*nearest) : std::nullopt;
}

}  // namespace axiscal
