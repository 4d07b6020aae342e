// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/timestamp.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <utility>
#include <vector>

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

// The start of a year [s since 1970-01-01 UTC].
double start_of_year(int year) {
  const std::chrono::year_month_day first{std::chrono::year(year), std::chrono::January,
                                          std::chrono::day(1)};
  return static_cast<double>(std::chrono::sys_days(first).time_since_epoch().count()) * 86400.0;
}

}  // namespace

double seconds_now() {
  return static_cast<double>(std::time(nullptr));
}

double output_seconds() {
  if (const char* const stated = std::getenv("SOURCE_DATE_EPOCH"); stated != nullptr) {
    char* end = nullptr;
    const long long seconds = std::strtoll(stated, &end, 10);
    constexpr long long year_10000_s = 253402300800;
    if (end != stated && *end == 0 && seconds >= 0 && seconds < year_10000_s) {
      return static_cast<double>(seconds);
    }
  }
  return seconds_now();
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

namespace {

// Reads a date of three numbers: 2011-10-09, 2011/10/9, 9.10.2011, 9-10-2011, 10/9/2011. Returns
// seconds since 1970-01-01.
std::optional<double> parse_day(std::string_view text, UnclearDays unclear) {
  for (const char sign : {'-', '/', '.'}) {
    const std::vector<std::string_view> parts = split(text, sign);
    if (parts.size() != 3) {
      continue;
    }
    constexpr std::size_t digits_of_year = 4;
    const bool year_first = parts[0].size() == digits_of_year;
    if (!year_first && parts[2].size() != digits_of_year) {
      return std::nullopt;
    }
    const std::optional<int> year = parse_integer(year_first ? parts[0] : parts[2]);
    std::optional<int> month = parse_integer(parts[1]);
    std::optional<int> day = parse_integer(year_first ? parts[2] : parts[0]);
    if (!year || !month || !day || *year < 0 || *month < 1 || *day < 1) {
      return std::nullopt;
    }
    constexpr int months = 12;
    if (!year_first && sign == '/' && *day <= months) {
      if (*month <= months && *month != *day && unclear == UnclearDays::refused) {
        return std::nullopt;
      }
      std::swap(month, day);
    }
    const std::chrono::year_month_day date{std::chrono::year(*year),
                                           std::chrono::month(static_cast<unsigned>(*month)),
                                           std::chrono::day(static_cast<unsigned>(*day))};
    if (!date.ok()) {
      return std::nullopt;
    }
    return static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count()) * 86400.0;
  }
  return std::nullopt;
}

// Reads a time of day: 14:08, 14:08:06.818, 14:08:06,818, 14:08:06:818, 1:05:00.5 PM. Returns
// seconds since midnight.
std::optional<double> parse_clock(std::string_view text) {
  double shift_h = 0.0;
  bool is_half_day = false;
  for (const auto& [word, hours] :
       {std::pair("AM", 0.0), std::pair("PM", 12.0), std::pair("am", 0.0), std::pair("pm", 12.0)}) {
    if (text.ends_with(word)) {
      text = trimmed(text.substr(0, text.size() - 2));
      shift_h = hours;
      is_half_day = true;
    }
  }
  const std::vector<std::string_view> parts = split(text, ':');
  if (parts.size() < 2 || parts.size() > 4 || parts[0].size() > 2) {
    return std::nullopt;
  }
  std::string seconds(parts.size() > 2 ? parts[2] : "0");
  std::replace(seconds.begin(), seconds.end(), ',', '.');
  const std::optional<int> hour = parse_integer(parts[0]);
  const std::optional<int> minute = parse_integer(parts[1]);
  const std::optional<double> second = parse_number(seconds);
  const std::optional<int> more = parts.size() == 4 ? parse_integer(parts[3]) : std::optional(0);
  constexpr int hours_of_day = 24;
  if (!hour || !minute || !second || !more || *hour < 0 || *hour >= hours_of_day || *minute < 0 ||
      *minute >= 60 || !(*second >= 0.0 && *second < 61.0) || *more < 0) {
    return std::nullopt;
  }
  constexpr std::size_t digits_of_us = 6;
  const double fraction =
      (parts.size() == 4 && parts[3].size() == digits_of_us ? 1e-6 : 1e-3) * *more;
  const double hours = is_half_day ? *hour % 12 + shift_h : *hour;
  return 3600.0 * hours + 60.0 * *minute + *second + fraction;
}

}  // namespace

std::optional<double> parse_clock_time(std::string_view text, UnclearDays unclear) {
  text = trimmed(text);
  if (const std::optional<double> stamp = parse_timestamp(text)) {
    return stamp;
  }
  const std::size_t end = text.find_first_of(" T,");
  const std::optional<double> day = parse_day(text.substr(0, end), unclear);
  if (!day) {
    return parse_clock(text);
  }
  if (end == std::string_view::npos) {
    return day;
  }
  const std::optional<double> time = parse_clock(trimmed(text.substr(end + 1)));
  return time ? std::optional(*day + *time) : std::nullopt;
}

std::string timestamp_now() {
  return timestamp_of(static_cast<double>(std::time(nullptr)));
}

std::string output_timestamp() {
  return timestamp_of(output_seconds());
}

std::string timestamp_of(double seconds) {
  const auto whole = static_cast<std::time_t>(std::floor(seconds));
  std::tm utc{};
  gmtime_r(&whole, &utc);
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
