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
/// @return nullopt if `name` is empty and there is no such column.
/// @throws DataError  if there is no column `name`.
[[nodiscard]] std::optional<TimeColumn> find_time_column(const std::string& path,
                                                         const std::vector<std::string>& columns,
                                                         const std::string& name);

/// @return the mean step of times, without gaps; NaN if the times never increase. Steps are
///         included up to 20 times the mean, because logs that come in bursts have many short steps
///         and few long ones.
[[nodiscard]] double usual_step(std::span<const double> times);

/// The unit of a column of times.
struct TimeUnit {
  double seconds = 1.0;  ///< seconds per unit
  std::string remark;    ///< a warning; empty if the unit is as stated or assumed
};

/// Determines the unit of a log's times by the rate that it gives.
///
/// Inertial logs have rates of 0.5 Hz to 1 MHz. If the name of the column states no unit, and the
/// times in seconds give another rate, the only unit with a usual rate is used. So is the unit in
/// which the times are seconds since 1970. A remark then states the unit.
///
/// @param times  the first times_that_settle_the_unit times are used.
/// @throws DataError  if no unit or several units are possible; the message contains the rate for
///                    each unit.
[[nodiscard]] TimeUnit settle_time_unit(const std::string& path,
                                        const TimeColumn& column,
                                        std::span<const double> times);

/// The number of first times of a log that determine their unit.
inline constexpr std::size_t times_that_settle_the_unit = 4096;

}  // namespace axiscal
