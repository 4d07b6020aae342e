// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace axiscal {

/// Reads a date or date and time of ISO 8601: 2026-11-20, 2026-11-20T20:04:54.5Z, ...+01:00.
///
/// @return seconds since 1970-01-01T00:00:00 UTC, or nothing if it is no such text. Without an
///         offset the time is UTC; the separator may be a blank.
[[nodiscard]] std::optional<double> parse_timestamp(std::string_view text);

/// @return now, in UTC and whole seconds: 2026-11-20T20:04:54Z.
[[nodiscard]] std::string timestamp_now();

/// @return the present as seconds since 1970-01-01, UTC.
[[nodiscard]] double seconds_now();

/// @return whether a time is one since 1970, UTC, and not one since a recording began: whether it
///         is after the year 2000.
[[nodiscard]] bool is_utc(double time_s);

/// @return the decimal year of a time: 2026.5 is in the middle of 2026.
/// @param seconds  since 1970-01-01, UTC.
[[nodiscard]] double decimal_year_of(double seconds);

/// A date as users give it: ISO 8601 (UTC) or a decimal year.
/// @return seconds since 1970-01-01, UTC; nothing for another text.
[[nodiscard]] std::optional<double> parse_date(std::string_view text);

/// A clock's number as seconds: phones and computers count seconds, milli-, micro- or nanoseconds
/// since 1970, which are 1e9, 1e12, 1e15, 1e18 in these years.
///
/// @return [s]; the number itself where it is below 1e11, that is before the year 5138.
[[nodiscard]] double seconds_of_clock(double number);

}  // namespace axiscal
