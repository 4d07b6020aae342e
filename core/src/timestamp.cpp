// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/timestamp.hpp"

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>

#include "axiscal/core/number_text.hpp"

namespace axiscal {
namespace {

// Takes exactly `digits` digits from the front of the text.
std::optional<int> take_digits(std::string_view& text, std::size_t digits) {
  if (text.size() < digits ||
      text.substr(0, digits).find_first_not_of("0123456789") != std::string_view::npos) {
    return std::nullopt;
  }
  const std::optional<int> value = parse_integer(text.substr(0, digits));
  text.remove_prefix(digits);
  return value;
}

bool take(std::string_view& text, char c) {
  if (text.empty() || text.front() != c) {
    return false;
  }
  text.remove_prefix(1);
  return true;
}

std::optional<double> parse_time_of_day(std::string_view& text) {
  const std::optional<int> hour = take_digits(text, 2);
  if (!hour || *hour > 24 || !take(text, ':')) {
    return std::nullopt;
  }
  const std::optional<int> minute = take_digits(text, 2);
  if (!minute || *minute > 59) {
    return std::nullopt;
  }
  double second = 0.0;
  if (take(text, ':')) {
    const std::size_t length = text.find_first_not_of("0123456789.");
    const std::optional<double> value = parse_number(text.substr(0, length));
    if (!value || !(*value < 61.0)) {
      return std::nullopt;
    }
    second = *value;
    text.remove_prefix(length == std::string_view::npos ? text.size() : length);
  }
  return *hour * 3600.0 + *minute * 60.0 + second;
}

// Where a year begins, seconds since 1970.
double start_of_year(int year) {
  const std::chrono::year_month_day first{std::chrono::year(year), std::chrono::January,
                                          std::chrono::day(1)};
  return static_cast<double>(std::chrono::sys_days(first).time_since_epoch().count()) * 86400.0;
}

}  // namespace

double seconds_now() {
  return static_cast<double>(std::time(nullptr));
}

bool is_utc(double time_s) {
  constexpr double year_2000_s = 946684800.0;
  return time_s >= year_2000_s;
}

double decimal_year_of(double seconds) {
  constexpr double mean_year_s = 365.2425 * 86400.0;
  auto year = static_cast<int>(std::floor(1970.0 + seconds / mean_year_s));
  while (start_of_year(year) > seconds) {
    --year;
  }
  while (start_of_year(year + 1) <= seconds) {
    ++year;
  }
  const double start = start_of_year(year);
  return year + (seconds - start) / (start_of_year(year + 1) - start);
}

std::optional<double> parse_date(std::string_view text) {
  const std::optional<double> year = parse_number(text);
  if (!year) {
    return parse_timestamp(text);
  }
  if (!(*year > -9999.0 && *year < 9999.0)) {
    return std::nullopt;
  }
  const auto whole = static_cast<int>(std::floor(*year));
  const double start = start_of_year(whole);
  return start + (*year - whole) * (start_of_year(whole + 1) - start);
}

std::optional<double> parse_timestamp(std::string_view text) {
  const std::optional<int> year = take_digits(text, 4);
  const bool first = take(text, '-');
  const std::optional<int> month = take_digits(text, 2);
  const bool second = take(text, '-');
  const std::optional<int> day = take_digits(text, 2);
  if (!year || !first || !month || !second || !day) {
    return std::nullopt;
  }
  const std::chrono::year_month_day date{std::chrono::year(*year),
                                         std::chrono::month(static_cast<unsigned>(*month)),
                                         std::chrono::day(static_cast<unsigned>(*day))};
  if (!date.ok()) {
    return std::nullopt;
  }
  double seconds =
      static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count()) * 86400.0;
  if (text.empty()) {
    return seconds;
  }
  if (!take(text, 'T') && !take(text, ' ')) {
    return std::nullopt;
  }
  const std::optional<double> time = parse_time_of_day(text);
  if (!time) {
    return std::nullopt;
  }
  seconds += *time;
  if (text.empty() || text == "Z") {
    return seconds;
  }
  const double sign = text.front() == '-' ? 1.0 : -1.0;
  if (!take(text, '+') && !take(text, '-')) {
    return std::nullopt;
  }
  const std::optional<double> offset = parse_time_of_day(text);
  if (!offset || !text.empty()) {
    return std::nullopt;
  }
  return seconds + sign * *offset;
}

std::string timestamp_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  const std::size_t length = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc);
  return {text.data(), length};
}

double seconds_of_clock(double number) {
  double seconds = number;
  constexpr double latest = 1e11;
  constexpr int coarser = 3;  // milli, micro, nano
  for (int i = 0; i < coarser && std::abs(seconds) >= latest; ++i) {
    seconds *= 1e-3;
  }
  return seconds;
}

}  // namespace axiscal
