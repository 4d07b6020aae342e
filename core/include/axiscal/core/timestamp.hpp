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
///         Without an offset the time is UTC. The separator may be a blank.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> parse_timestamp(std::string_view text);

/// Whether 10/9/2011 may be read at all: the month comes first in America, the day elsewhere.
enum class UnclearDays {
  month_first,  ///< as 9 October, as American instruments write
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

/// @return the present as seconds since 1970-01-01, UTC.
[[nodiscard]] AXISCAL_EXPORT double seconds_now();

/// @return the time at which an output states to be made: SOURCE_DATE_EPOCH if that is set
///         (reproducible-builds.org), else now; UTC seconds, and as timestamp_now().
[[nodiscard]] AXISCAL_EXPORT double output_seconds();
[[nodiscard]] AXISCAL_EXPORT std::string output_timestamp();

/// @return true if a time counts from 1970 UTC and not from the start of a recording: whether it is
///         after the year 2000.
[[nodiscard]] AXISCAL_EXPORT bool is_utc(double time_s);

/// @return the decimal year of a time: 2026.5 is in the middle of 2026.
/// @param seconds  since 1970-01-01, UTC.
[[nodiscard]] AXISCAL_EXPORT double decimal_year_of(double seconds);

/// A date as users give it: ISO 8601 (UTC) or a decimal year.
/// @return seconds since 1970-01-01 UTC; nullopt for another text.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> parse_date(std::string_view text);

/// A clock's number as seconds: phones and computers count seconds, milli-, micro- or nanoseconds
/// since 1970, which are 1e9, 1e12, 1e15, 1e18 in these years.
///
/// @return [s]; the number itself where it is below 1e11, that is before the year 5138.
[[nodiscard]] AXISCAL_EXPORT double seconds_of_clock(double number);

}  // namespace axiscal
