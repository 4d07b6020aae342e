// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/logs/log_file.hpp"
#include "axiscal/logs/recording_file.hpp"

namespace axiscal {

/// The meaning of a table's columns.
struct TableColumns {
  std::vector<Series> series;       ///< one a column: kind, unit, known_by
  std::optional<std::size_t> time;  ///< column of times
  double seconds = 0.0;             ///< seconds per unit of the times; 0 if unknown
};

/// True if the name of a column is meaningless: c4, x, ch2, data_3. For other names (a quaternion,
/// for example) numbers alone are not proof.
[[nodiscard]] bool is_generic_name(std::string_view name);

/// By names and units (SensorColumns). If these are not helpful, by the first numbers: a column
/// that rises evenly is the time; three neighbours with the length of gravity are an accelerometer;
/// three that rotate it are a gyroscope.
///
/// @param block  the first rows, a column for each name.
[[nodiscard]] TableColumns recognise_columns(const std::vector<std::string>& columns,
                                             std::string_view table,
                                             const LogBlock& block);

}  // namespace axiscal
