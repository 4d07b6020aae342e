// SPDX-License-Identifier: Apache-2.0
#define FMT_HEADER_ONLY
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>

#include <fmt/format.h>

#include "axiscal/core/number_text.hpp"

namespace axiscal {
namespace {

constexpr int most_digits = 17;  // of the shortest decimal that reads back to a double

constexpr std::array<std::uint64_t, most_digits + 1> powers_of_ten = [] {
  std::array<std::uint64_t, most_digits + 1> powers{1};
  for (std::size_t i = 1; i < powers.size(); ++i) {
    powers[i] = 10 * powers[i - 1];
  }
  return powers;
}();

int digits_of(std::uint64_t number) {
  constexpr int log2_to_log10 = 1233;  // of 4096
  const int least = (static_cast<int>(std::bit_width(number)) * log2_to_log10) >> 12;
  return least + (number >= powers_of_ten[static_cast<std::size_t>(least)] ? 1 : 0);
}

// The eight digits of a number below 1e8 as characters, the first in the lowest byte: by halves,
// all at once.
std::uint64_t eight_characters(std::uint64_t number) {
  const std::uint64_t thousands = number / 10000;
  const std::uint64_t fours = thousands | (number - 10000 * thousands) << 32;
  const std::uint64_t hundreds = ((fours * 10486) >> 20) & 0x0000007F0000007FU;
  const std::uint64_t twos = ((fours - 100 * hundreds) << 16) + hundreds;
  const std::uint64_t tens = ((twos * 103) >> 10) & 0x000F000F000F000FU;
  return tens + ((twos - 10 * tens) << 8) + 0x3030303030303030U;
}

// A positive number as std::to_chars() writes it, where that is without an exponent and of 7 digits
// before the point at most; null elsewhere.
char* write_plain(char* first, double value) noexcept {
  const auto decimal = fmt::detail::dragonbox::to_decimal(value);
  const int digits = digits_of(decimal.significand);
  const int before_point = digits + decimal.exponent;
  // It writes an exponent where that is shorter.
  constexpr int exponent_characters = 4;  // "e-05"
  const int scientific = digits + (digits > 1 ? 1 : 0) + exponent_characters;
  const int fixed = before_point >= digits ? before_point
                    : before_point > 0     ? digits + 1
                                           : digits + 2 - before_point;
  constexpr int most_before_point = 7;
  if (fixed > scientific || before_point > most_before_point) {
    return nullptr;
  }
  // All 17, with zeros behind: one, and twice eight.
  constexpr std::uint64_t eight = 100000000;
  const std::uint64_t all =
      decimal.significand * powers_of_ten[static_cast<std::size_t>(most_digits - digits)];
  const std::uint64_t upper = all / eight;
  const char leading = static_cast<char>('0' + upper / eight);
  const std::uint64_t middle = eight_characters(upper % eight);
  const std::uint64_t last = eight_characters(all % eight);
  if (before_point <= 0) {
    std::memcpy(first, "0.0000", 6);
    char* const at = first + 2 - before_point;
    *at = leading;
    std::memcpy(at + 1, &middle, sizeof middle);
    std::memcpy(at + 1 + sizeof middle, &last, sizeof last);
    return first + fixed;
  }
  // One place on, where what follows the point belongs; the first eight characters are then put
  // together with the point among them.
  std::memcpy(first + 2, &middle, sizeof middle);
  std::memcpy(first + 2 + sizeof middle, &last, sizeof last);
  const std::uint64_t start = static_cast<unsigned char>(leading) | middle << 8;
  const auto bits = static_cast<unsigned>(8 * before_point);
  const std::uint64_t whole = start & ((std::uint64_t{1} << bits) - 1);
  const std::uint64_t with_point =
      whole | std::uint64_t{'.'} << bits | (start & ~((std::uint64_t{1} << bits) - 1)) << 8;
  std::memcpy(first, &with_point, sizeof with_point);
  return first + fixed;
}

}  // namespace

char* write_number(char* first, double value) noexcept {
  const double size = std::abs(value);
  if (std::endian::native == std::endian::little && size >= 1e-4 && size < 1e7) {
    *first = '-';
    char* const digits = first + (value < 0.0 ? 1 : 0);
    if (char* const end = write_plain(digits, size)) {
      return end;
    }
  }
  return std::to_chars(first, first + number_text_size, value + 0.0).ptr;  // -0 + 0 is 0
}

}  // namespace axiscal
