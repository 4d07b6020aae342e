// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace axiscal {

/// A column of times by its name: time, t, timestamp, with _s, _ms, _us, _ns or so.
struct TimeColumn {
  std::size_t position = 0;
  double seconds = 1.0;         ///< per unit of the column
  bool unit_is_stated = false;  ///< the name gives the unit; otherwise seconds are assumed
  std::string name;
};

/// @param path  of the log, for messages.
/// @param name  of the column; empty: the first that is called so.
/// @return nullopt if there is none and no name was given.
/// @throws DataError  if the named column is not there.
[[nodiscard]] std::optional<TimeColumn> find_time_column(const std::string& path,
                                                         const std::vector<std::string>& columns,
                                                         const std::string& name);

/// The mean step of times, without gaps: logs that come in bursts have many short steps and few
/// long ones.
/// @return NaN where they never increase.
[[nodiscard]] double usual_step(std::span<const double> times);

/// The unit of a column of times, with notes about the unit.
struct TimeUnit {
  double seconds = 1.0;
  std::string remark;  ///< a warning; empty where all is as expected
};

/// Settles the unit of a log's times by the rate that it gives.
///
/// Inertial logs have 0.5 Hz to 1 MHz. Where the column's name states no unit and seconds give
/// another rate, or where the times are seconds since 1970 in another unit only, that unit is taken
/// and said.
///
/// @param times  the first thousands.
/// @throws DataError  where several units are possible, or none: the message has the rate of each.
[[nodiscard]] TimeUnit settle_time_unit(const std::string& path,
                                        const TimeColumn& column,
                                        std::span<const double> times);

/// Number of a log's first times that determine their unit.
inline constexpr std::size_t times_that_settle_the_unit = 4096;

}  // namespace axiscal
