// SPDX-License-Identifier: Apache-2.0
#define FMT_HEADER_ONLY
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>

#include <fmt/format.h>

#include "axiscal/core/number_text.hpp"

namespace axiscal {
namespace {

constexpr int most_digits = 17;  // enough digits for any double

constexpr std::array<std::uint64_t, most_digits + 1> powers_of_ten = [] {
  std::array<std::uint64_t, most_digits + 1> powers{1};
  for (std::size_t i = 1; i < powers.size(); ++i) {
    powers[i] = 10 * powers[i - 1];
  }
  return powers;
}();

int digits_of(std::uint64_t number) {
  constexpr int log2_to_log10 = 1233;  // log10(2) is about 1233 / 4096
  const int least = (static_cast<int>(std::bit_width(number)) * log2_to_log10) >> 12;
  return least + (number >= powers_of_ten[static_cast<std::size_t>(least)] ? 1 : 0);
}

// Returns the eight digits of a number below 1e8 as characters, the first digit in the lowest byte.
// The number is split into halves, then quarters, then digits. Each step treats all parts at once.
std::uint64_t eight_characters(std::uint64_t number) {
  const std::uint64_t thousands = number / 10000;
  const std::uint64_t fours = thousands | (number - 10000 * thousands) << 32;
  const std::uint64_t hundreds = ((fours * 10486) >> 20) & 0x0000007F0000007FU;
  const std::uint64_t twos = ((fours - 100 * hundreds) << 16) + hundreds;
  const std::uint64_t tens = ((twos * 103) >> 10) & 0x000F000F000F000FU;
  return tens + ((twos - 10 * tens) << 8) + 0x3030303030303030U;
}

// The digits of a decimal number, padded with zeros to 17: one digit, then two groups of eight.
struct Digits {
  char leading;
  std::uint64_t middle;
  std::uint64_t last;
};

Digits all_digits(std::uint64_t significand, int count) {
  constexpr std::uint64_t eight = 100000000;
  const std::uint64_t all =
      significand * powers_of_ten[static_cast<std::size_t>(most_digits - count)];
  const std::uint64_t upper = all / eight;
  return {.leading = static_cast<char>('0' + upper / eight),
          .middle = eight_characters(upper % eight),
          .last = eight_characters(all % eight)};
}

// Writes a number below 1: "0.", then `zeros` zeros, then all digits.
void put_fraction(char* first, const Digits& digits, int zeros) {
  std::memcpy(first, "0.0000", 6);
  char* const at = first + 2 + zeros;
  *at = digits.leading;
  std::memcpy(at + 1, &digits.middle, sizeof digits.middle);
  std::memcpy(at + 1 + sizeof digits.middle, &digits.last, sizeof digits.last);
}

// Writes a number that has `before_point` digits (1 to 7) before the decimal point. First, all
// digits except the leading one are written from the third character on. Then the first eight
// characters are overwritten by the leading digits with the decimal point between them.
void put_pointed(char* first, const Digits& digits, int before_point) {
  std::memcpy(first + 2, &digits.middle, sizeof digits.middle);
  std::memcpy(first + 2 + sizeof digits.middle, &digits.last, sizeof digits.last);
  const std::uint64_t start = static_cast<unsigned char>(digits.leading) | digits.middle << 8;
  const auto bits = static_cast<unsigned>(8 * before_point);
  const std::uint64_t of_whole = (std::uint64_t{1} << bits) - 1;
  const std::uint64_t with_point =
      (start & of_whole) | std::uint64_t{'.'} << bits | (start & ~of_whole) << 8;
  std::memcpy(first, &with_point, sizeof with_point);
}

// Writes an exponent such as "e-05" or "e+300".
char* put_exponent(char* first, int exponent) {
  *first++ = 'e';
  *first++ = exponent < 0 ? '-' : '+';
  const int size = std::abs(exponent);
  if (size >= 100) {
    *first++ = static_cast<char>('0' + size / 100);
  }
  *first++ = static_cast<char>('0' + size / 10 % 10);
  *first++ = static_cast<char>('0' + size % 10);
  return first;
}

// Writes a positive number as std::to_chars() does. Returns null if the text would have no exponent
// and more than 7 digits before the point.
char* write_positive(char* first, double value) noexcept {
  const auto decimal = fmt::detail::dragonbox::to_decimal(value);
  const int count = digits_of(decimal.significand);
  const int before_point = count + decimal.exponent;
  // std::to_chars() writes an exponent if the text is then shorter.
  const int exponent = before_point - 1;
  const int mantissa = count + (count > 1 ? 1 : 0);
  const int scientific = mantissa + (std::abs(exponent) >= 100 ? 5 : 4);
  const int fixed = before_point >= count ? before_point
                    : before_point > 0    ? count + 1
                                          : count + 2 - before_point;
  constexpr int most_before_point = 7;
  const Digits digits = all_digits(decimal.significand, count);
  if (scientific < fixed) {
    put_pointed(first, digits, 1);
    return put_exponent(first + mantissa, exponent);
  }
  if (before_point > most_before_point) {
    return nullptr;
  }
  if (before_point <= 0) {
    put_fraction(first, digits, -before_point);
  } else {
    put_pointed(first, digits, before_point);
  }
  return first + fixed;
}

}  // namespace

char* write_number(char* first, double value) noexcept {
  const double size = std::abs(value);
  if (std::endian::native == std::endian::little && size > 0.0 &&
      size <= std::numeric_limits<double>::max()) {
    *first = '-';
    char* const digits = first + (value < 0.0 ? 1 : 0);
    if (char* const end = write_positive(digits, size)) {
      return end;
    }
  }
  return std::to_chars(first, first + number_text_size, value + 0.0).ptr;  // -0 + 0 is 0
}

}  // namespace axiscal
