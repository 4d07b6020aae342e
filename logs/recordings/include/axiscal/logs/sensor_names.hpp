// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/logs/recording_file.hpp"

namespace axiscal {

/// @return the text with A to Z replaced by a to z; other characters stay unchanged.
[[nodiscard]] std::string to_lower_case(std::string_view text);

/// A unit of measurement that known_unit() recognises, for example from "m/s²", "dps" or "Gauss".
struct KnownUnit {
  /// Spelling that axiscal uses: "m/s^2", "g", "deg/s", "uT", "gauss", "degC", ...
  std::string_view name;
  SeriesKind kind = SeriesKind::other;  ///< kind of sensor that has this unit
  double si = 1.0;                      ///< factor that converts to m/s^2, rad/s or T
};

/// @param of  kind of sensor whose readings have the unit; `other` if the kind is not known.
/// @return the unit; nullopt if it is unknown. "G" is gauss for a magnetometer, otherwise standard
///         gravity. "mG" is milligauss for a magnetometer or `other`, otherwise 1e-3 g.
[[nodiscard]] std::optional<KnownUnit> known_unit(std::string_view text,
                                                  SeriesKind of = SeriesKind::other);

/// The parts of a column's header: a name and the unit that follows it, as in "ax (m/s^2)",
/// "Temperature / degC", "time in ms" or "x [V]".
struct NamedColumn {
  std::string name;
  std::string unit;  ///< unit as written in the header; empty if the header states no unit
};

/// Splits "x [V]" into name and unit. Brackets with numbers, as in "gyro_rad[0]", are not units.
[[nodiscard]] NamedColumn named_column(std::string_view header);

/// @return the kind of sensor that a text names, for example by "acc", "gyr", "mag" or "temp";
///         `other` if the text names no sensor.
[[nodiscard]] SeriesKind sensor_kind_in(std::string_view words);

/// @return 0, 1 or 2 if the name contains an axis x, y or z: "AccX", "gyro_y", "Acc_Z", "accel[2]",
///         "mag.x"; otherwise nullopt.
[[nodiscard]] std::optional<std::size_t> axis_of_name(std::string_view name);

/// The meaning of a table's columns, from their names and units.
class SensorColumns {
 public:
  /// @param columns  names in the table's header.
  /// @param table    name of the table. It may show the kind of sensor: the columns x, y, z of
  ///                 "Accelerometer.csv" belong to an accelerometer.
  explicit SensorColumns(const std::vector<std::string>& columns, std::string_view table = "");

  /// @return one Series for each column; only kind, unit and known_by are set.
  [[nodiscard]] const std::vector<Series>& series() const { return series_; }

  /// @return the index of the column of times; nullopt if there is none.
  [[nodiscard]] std::optional<std::size_t> time() const { return time_; }

  /// @return seconds per unit of the times, from the column's name; 0 if the name states no unit.
  [[nodiscard]] double seconds() const { return seconds_; }

 private:
  std::vector<Series> series_;
  std::optional<std::size_t> time_;
  double seconds_ = 0.0;
};

}  // namespace axiscal
