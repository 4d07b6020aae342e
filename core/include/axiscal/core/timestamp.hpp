// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// Reads a date or date and time of ISO 8601: 2026-11-20, 2026-11-20T20:04:54.5Z, ...+01:00.
///
/// @return seconds since 1970-01-01T00:00:00 UTC, or nullopt if the text is not a timestamp.
///         Without an offset the time is UTC. Date and time may be separated by a blank.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> parse_timestamp(std::string_view text);

/// How to read an ambiguous date such as 10/9/2011: the month is first in America, the day
/// elsewhere.
enum class UnclearDays {
  month_first,  ///< 9 October, as American instruments write
  refused,
};

/// Reads a time as instruments and spreadsheets write it: ISO 8601, and 2011/10/09 10:25:00:500,
/// 27.03.2026 14:08:06,818, 10/9/2011 1:05:00.5 PM, 14:08:06.
///
/// @param unclear  treatment of a date with slashes whose month and day may be exchanged.
/// @return seconds since 1970-01-01T00:00:00 UTC; for a time without a date, seconds since
///         midnight; nullopt if the text is not a time.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> parse_clock_time(
    std::string_view text, UnclearDays unclear = UnclearDays::month_first);

/// @param seconds  since 1970-01-01T00:00:00 UTC.
/// @return that time in UTC and whole seconds: 2026-11-20T20:04:54Z.
[[nodiscard]] AXISCAL_EXPORT std::string timestamp_of(double seconds);

/// @return now, in UTC and whole seconds: 2026-11-20T20:04:54Z.
[[nodiscard]] AXISCAL_EXPORT std::string timestamp_now();

/// @return the present time [s since 1970-01-01 UTC].
[[nodiscard]] AXISCAL_EXPORT double seconds_now();

/// @return the creation time for outputs: SOURCE_DATE_EPOCH if it is set (reproducible-builds.org),
///         else now. output_seconds() returns it in seconds since 1970-01-01 UTC,
///         output_timestamp() as text like timestamp_now().
[[nodiscard]] AXISCAL_EXPORT double output_seconds();
[[nodiscard]] AXISCAL_EXPORT std::string output_timestamp();

/// @return true if a time counts from 1970 UTC, false if it counts from the start of a recording.
///         Times from the year 2000 on are taken as UTC.
[[nodiscard]] AXISCAL_EXPORT bool is_utc(double time_s);

/// @return the decimal year of a time: 2026.5 is in the middle of 2026.
/// @param seconds  since 1970-01-01, UTC.
[[nodiscard]] AXISCAL_EXPORT double decimal_year_of(double seconds);

/// Reads a date as users write it: ISO 8601 (UTC) or a decimal year.
/// @return seconds since 1970-01-01 UTC; nullopt if the text is neither.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> parse_date(std::string_view text);

/// Converts a clock's number to seconds. Phones and computers count seconds, milliseconds,
/// microseconds or nanoseconds since 1970; these numbers are now about 1e9, 1e12, 1e15 and 1e18.
///
/// @return [s]; the number itself if it is below 1e11, which in seconds is the year 5138.
[[nodiscard]] AXISCAL_EXPORT double seconds_of_clock(double number);

}  // namespace axiscal
