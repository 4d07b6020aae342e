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
/// @param name  name of the column; if empty, the first column whose name denotes times is found.
/// @return nullopt if `name` is empty and no column has a name that denotes times.
/// @throws DataError  if `name` is not empty and the log has no column of that name.
[[nodiscard]] std::optional<TimeColumn> find_time_column(const std::string& path,
                                                         const std::vector<std::string>& columns,
                                                         const std::string& name);

/// @return the mean difference of successive times, excluding gaps; NaN if the times never
///         increase. A step counts as a gap only if it is longer than 20 times the mean, because
///         samples that arrive in bursts have many short steps and few long ones.
[[nodiscard]] double usual_step(std::span<const double> times);

/// The unit of a column of times.
struct TimeUnit {
  double seconds = 1.0;  ///< seconds per unit
  std::string remark;    ///< a warning about the unit; may be empty
};

/// Determines the unit of a log's times.
///
/// If the name of the column states a unit, it is used. Otherwise the first possible unit is used:
/// - a unit of Xsens, if the column is its SampleTimeFine,
/// - days, if the times are plausible dates of a spreadsheet,
/// - the unit for which the times, counted from the start of 1970, are in the years 2001 to 2039,
/// - seconds, if they give a rate of 0.5 Hz to 1 MHz,
/// - the only unit of s, ms, us and ns that gives a rate of 0.5 Hz to 2 kHz.
///
/// The result has a remark if a unit other than seconds was assumed, or if the stated unit gives an
/// unusual rate.
///
/// @param path   path of the log, for messages.
/// @param times  times of the log. Only the first 4096 (times_that_settle_the_unit) are used.
/// @throws DataError  if no unit or several units are possible; the message states the rate that
///                    each unit would give.
[[nodiscard]] TimeUnit settle_time_unit(const std::string& path,
                                        const TimeColumn& column,
                                        std::span<const double> times);

/// Number of time stamps, from the start of a log, that settle_time_unit() uses.
inline constexpr std::size_t times_that_settle_the_unit = 4096;

}  // namespace axiscal
