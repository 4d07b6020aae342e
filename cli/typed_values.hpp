// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/tolerance.hpp"
#include "axiscal/calib/world.hpp"
#include "axiscal/instruments/inclination.hpp"
#include "usage_error.hpp"

// Parsers of the values of options.
namespace axiscal::cli {

/// Parses a number. @throws UsageError with the name of the option.
[[nodiscard]] double number_of(std::string_view option, const std::string& text);

/// Parses `count` numbers separated by commas. @throws UsageError with the name of the option.
[[nodiscard]] std::vector<double> numbers_of(std::string_view option,
                                             const std::string& text,
                                             std::size_t count);

/// Parses a range LO,HI. @throws UsageError with the name of the option.
[[nodiscard]] ReadingRange range_of(std::string_view option, const std::string& text);

/// Parses a number above 0. @throws UsageError with the name of the option.
[[nodiscard]] double parse_positive(std::string_view option, const std::string& text);

/// Parses a number that is 0 or more. @throws UsageError with the name of the option.
[[nodiscard]] double parse_nonnegative(std::string_view option, const std::string& text);

/// Parses a whole number that is `least` or more. @throws UsageError with the name of the option.
[[nodiscard]] int parse_whole_number(std::string_view option, const std::string& text, int least);

/// Parses a pitch formula, asin or atan2. @throws UsageError with the name of the option.
[[nodiscard]] PitchFormula pitch_formula_of(std::string_view option, const std::string& text);

/// Parses the value of --tolerances, NAME=SD,.. @throws UsageError if a name or number is invalid.
[[nodiscard]] Tolerances tolerances_of(const std::string& text);

/// Parses the value of --world, NAME=V,.. or a file name. @throws UsageError, DataError if it is
/// invalid.
[[nodiscard]] World world_of_option(const std::string& text);

/// Makes a site from --latitude, --longitude and --height. A missing value is taken from
/// `otherwise`.
/// @throws UsageError if a value is out of range.
[[nodiscard]] Site site_of_options(const std::optional<std::string>& latitude,
                                   const std::optional<std::string>& longitude,
                                   const std::optional<std::string>& height,
                                   Site otherwise);

/// Parses --date.
/// @return the time in seconds since 1970-01-01 UTC.
/// @throws UsageError if the text is not a date.
[[nodiscard]] double date_of_option(const std::string& text);

/// Parses --calibrated, a date or a date with time in ISO 8601.
/// @return the text as it is written in records: 2026-11-20, or 2026-11-20T20:04:54Z.
[[nodiscard]] std::string calibrated_of_option(const std::string& text);

/// Parses the value of --slope, X,Y. @throws UsageError unless X^2 + Y^2 < 1.
[[nodiscard]] Eigen::Vector2d slope_of_option(const std::string& text);

/// Parses --method. @throws UsageError if the value is unknown.
[[nodiscard]] Method method_of_option(const std::string& text);

/// Parses --drift. @throws UsageError if the value is unknown.
[[nodiscard]] DriftSetup drift_of_option(const std::string& text);

/// Parses --seats. @throws UsageError if the value is unknown.
[[nodiscard]] SeatSetup seats_of_option(const std::string& text);

/// Parses --level-by. @throws UsageError if the value is unknown.
[[nodiscard]] LevelBy levelness_scope_of_option(const std::string& text);

}  // namespace axiscal::cli
