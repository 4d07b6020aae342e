// SPDX-License-Identifier: Apache-2.0
#include "core/read_double.hpp"

#include <clocale>
#include <cmath>
#include <cstdlib>
#include <string>
#include <version>

#include <system_error>

#if defined(__APPLE__)
#include <xlocale.h>
#endif

namespace axiscal {
namespace {

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

const char* after_digits(const char* at, const char* last) {
  while (at != last && is_digit(*at)) {
    ++at;
  }
  return at;
}

// Returns the end of the longest decimal number that begins at `first`; `first` if there is none.
const char* end_of_decimal(const char* first, const char* last) {
  const char* at = first;
  if (at != last && *at == '-') {
    ++at;
  }
  const char* const whole = at;
  at = after_digits(at, last);
  auto digits = at - whole;
  if (at != last && *at == '.') {
    const char* const fraction = at + 1;
    at = after_digits(fraction, last);
    digits += at - fraction;
  }
  if (digits == 0) {
    return first;
  }
  if (at != last && (*at == 'e' || *at == 'E')) {
    const char* exponent = at + 1;
    if (exponent != last && (*exponent == '+' || *exponent == '-')) {
      ++exponent;
    }
    if (const char* const end = after_digits(exponent, last); end != exponent) {
      at = end;
    }
  }
  return at;
}

}  // namespace

std::from_chars_result read_double_by_c_library(const char* first,
                                                const char* last,
                                                double& value) noexcept {
  const char* const end = end_of_decimal(first, last);
  if (end == first) {
    return {first, std::errc::invalid_argument};
  }
  static const locale_t plain = ::newlocale(LC_ALL_MASK, "C", nullptr);
  const std::string text(first, end);
  const double read = ::strtod_l(text.c_str(), nullptr, plain);
  const std::size_t mantissa = text.find_first_of("eE");
  const bool is_zero = text.substr(0, mantissa).find_first_of("123456789") == std::string::npos;
  if (std::isinf(read) || (read == 0.0 && !is_zero)) {
    return {end, std::errc::result_out_of_range};
  }
  value = read;
  return {end, std::errc{}};
}

std::from_chars_result read_double(const char* first, const char* last, double& value) noexcept {
#ifdef __cpp_lib_to_chars
  return std::from_chars(first, last, value);
#else
  return read_double_by_c_library(first, last, value);
#endif
}

}  // namespace axiscal
