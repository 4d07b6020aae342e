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

}  // namespace axiscal
