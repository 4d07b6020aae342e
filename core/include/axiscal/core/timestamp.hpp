// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// Reads a date, or a date with a time, in ISO 8601: 2026-11-20, 2026-11-20T20:04:54.5Z,
/// 2026-11-20T21:04:54.5+01:00.
///
/// @return seconds since 1970-01-01T00:00:00 UTC, or nullopt if the text is not a timestamp.
///         Without an offset the time is UTC. Date and time may be separated by a blank.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> parse_timestamp(std::string_view text);

/// How to read an ambiguous date such as 10/9/2011. In America the month is first; elsewhere the
/// day is first.
enum class UnclearDays {
  month_first,  ///< 10/9/2011 is 9 October, the form of American instruments
  refused,
};

/// Reads a time in ISO 8601 or in a form that instruments and spreadsheets write:
/// 2011/10/09 10:25:00:500, 27.03.2026 14:08:06,818, 10/9/2011 1:05:00.5 PM, 14:08:06.
///
/// @param unclear  how to read a date with slashes in which either number may be the month.
/// @return seconds since 1970-01-01T00:00:00 UTC; for a time without a date, seconds since
///         midnight; nullopt if the text is not a time.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> parse_clock_time(
    std::string_view text, UnclearDays unclear = UnclearDays::month_first);

/// @param seconds  time in seconds since 1970-01-01T00:00:00 UTC.
/// @return the time as text, in UTC, rounded down to whole seconds: 2026-11-20T20:04:54Z.
[[nodiscard]] AXISCAL_EXPORT std::string timestamp_of(double seconds);

/// @return the present time as text, in UTC and whole seconds: 2026-11-20T20:04:54Z.
[[nodiscard]] AXISCAL_EXPORT std::string timestamp_now();

/// @return the present time [s since 1970-01-01 UTC].
[[nodiscard]] AXISCAL_EXPORT double seconds_now();

/// @return the creation time for outputs. It is the time in the environment variable
///         SOURCE_DATE_EPOCH (reproducible-builds.org) if that is set, otherwise the present time.
///         output_seconds() returns seconds since 1970-01-01 UTC; output_timestamp() returns text
///         in the form of timestamp_now().
[[nodiscard]] AXISCAL_EXPORT double output_seconds();
[[nodiscard]] AXISCAL_EXPORT std::string output_timestamp();

/// @param time_s  seconds since 1970-01-01 UTC, or since the start of a recording.
/// @return true if the time, read as seconds since 1970, is in the year 2000 or later. The time is
///         then assumed to be UTC.
[[nodiscard]] AXISCAL_EXPORT bool is_utc(double time_s);

/// @return the decimal year of a time: 2026.5 is in the middle of 2026.
/// @param seconds  time in seconds since 1970-01-01, UTC.
[[nodiscard]] AXISCAL_EXPORT double decimal_year_of(double seconds);

/// Reads a date as users write it: ISO 8601 (UTC) or a decimal year.
/// @return seconds since 1970-01-01 UTC; nullopt if the text is neither.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> parse_date(std::string_view text);

/// Converts a clock's number to seconds. Phones and computers count seconds, milliseconds,
/// microseconds or nanoseconds since 1970; these numbers are now about 1e9, 1e12, 1e15 and 1e18.
///
/// @return the time [s]. A number below 1e11 is taken as seconds, because 1e11 seconds since 1970
///         are the year 5138.
[[nodiscard]] AXISCAL_EXPORT double seconds_of_clock(double number);

}  // namespace axiscal
