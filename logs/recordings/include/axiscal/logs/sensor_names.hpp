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

/// @return the text with a to z for A to Z; other characters as they are.
[[nodiscard]] std::string in_small_letters(std::string_view text);

/// A unit as people write it: "m/s²", "dps", "µT", "Gauss".
struct KnownUnit {
  std::string_view
      name;  ///< as Axiscal writes it: "m/s^2", "g", "deg/s", "uT", "gauss", "degC", ...
  SeriesKind kind = SeriesKind::other;  ///< quantity of the unit
  double si = 1.0;                      ///< times this it is m/s^2, rad/s, T
};

/// @return the unit, or nullopt if it is unknown. "G" is gauss, except for an acceleration; "mG" is
///         milli-gauss, except for an acceleration.
[[nodiscard]] std::optional<KnownUnit> known_unit(std::string_view text,
                                                  SeriesKind of = SeriesKind::other);

/// A column's name and the unit behind it: "ax (m/s^2)", "x [V]", "Temperature / degC", "time in
/// ms".
struct NamedColumn {
  std::string name;
  std::string unit;  ///< as it stands there; empty where there is none
};

/// Splits "x [V]" into name and unit. Brackets with numbers, as in "gyro_rad[0]", are not units.
[[nodiscard]] NamedColumn named_column(std::string_view header);

/// @return the kind of sensor in a name: "acc", "gyr", "mag", "temp" and similar.
[[nodiscard]] SeriesKind kind_of_words(std::string_view words);

/// @return 0, 1, 2 for a name that is of an axis: "AccX", "gyro_y", "Acc_Z", "accel[2]", "mag.x";
/// the format's x, y, z; else nothing.
[[nodiscard]] std::optional<std::size_t> axis_of_name(std::string_view name);

/// The meaning of a table's columns, by their names and units.
class SensorColumns {
 public:
  /// @param columns  as the table's header has them.
  /// @param table    its name: of "Accelerometer.csv" x, y, z are an accelerometer's.
  explicit SensorColumns(const std::vector<std::string>& columns, std::string_view table = "");

  /// @return kind, unit and known_by of each column.
  [[nodiscard]] const std::vector<Series>& series() const { return series_; }

  /// @return the column of times, if there is one.
  [[nodiscard]] std::optional<std::size_t> time() const { return time_; }

  /// @return seconds per unit of the times, from the name; 0 if the name does not give it.
  [[nodiscard]] double seconds() const { return seconds_; }

 private:
  std::vector<Series> series_;
  std::optional<std::size_t> time_;
  double seconds_ = 0.0;
};

}  // namespace axiscal
