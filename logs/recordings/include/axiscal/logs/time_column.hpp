// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace axiscal {

/// A column of times, recognised by its name: time, t, timestamp, with _s, _ms, _us, _ns or
/// similar.
struct TimeColumn {
  std::size_t position = 0;
  double seconds = 1.0;         ///< seconds per unit of the column
  bool unit_is_stated = false;  ///< true if the name states the unit
  std::string name;
};

/// @param path  path of the log, for messages.
/// @param name  name of the column; if empty, the first column with the name of a time is found.
/// @return nullopt if `name` is empty and no column has the name of a time.
/// @throws DataError  if `name` is not empty and the log has no column of that name.
[[nodiscard]] std::optional<TimeColumn> find_time_column(const std::string& path,
                                                         const std::vector<std::string>& columns,
                                                         const std::string& name);

/// @return the mean step of times, without gaps; NaN if the times never increase. Steps of up to 20
///         times the mean are included, because samples that arrive in bursts have many short steps
///         and few long ones.
[[nodiscard]] double usual_step(std::span<const double> times);

/// The unit of a column of times.
struct TimeUnit {
  double seconds = 1.0;  ///< seconds per unit
  std::string remark;    ///< a warning about the unit; may be empty
};

/// Determines the unit of a log's times.
///
/// If the name of the column states a unit, it is used. Otherwise the unit is the first of these:
/// - the unit in which the times are times since 1970,
/// - seconds, if they give a rate of 0.5 Hz to 1 MHz,
/// - the only unit of s, ms, us and ns that gives a rate of 0.5 Hz to 2 kHz.
/// Days (from spreadsheets) and the units of Xsens's SampleTimeFine are recognised before these. A
/// remark states a unit that was assumed and is not seconds, or a stated unit with an unusual rate.
///
/// @param times  times of the log, of which the first times_that_settle_the_unit are used.
/// @throws DataError  if no unit or several units are possible; the message contains the rate for
///                    each unit.
[[nodiscard]] TimeUnit settle_time_unit(const std::string& path,
                                        const TimeColumn& column,
                                        std::span<const double> times);

/// The number of first times of a log that determine their unit.
inline constexpr std::size_t times_that_settle_the_unit = 4096;

}  // namespace axiscal
