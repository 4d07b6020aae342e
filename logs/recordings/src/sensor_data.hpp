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
  std::vector<Series> series;       ///< kind, unit and known_by of each column
  std::optional<std::size_t> time;  ///< column of times
  double seconds = 0.0;             ///< seconds per unit of the times; 0 if unknown
};

/// @return true if the name of a column has no meaning: c4, x, ch2, data_3. Columns with other
///         names (for example a quaternion) are not recognised by numbers.
[[nodiscard]] bool is_generic_name(std::string_view name);

/// Recognises columns by names and units (SensorColumns). If these do not show a sensor, the first
/// rows are used. The first column is the time if it rises evenly. Three neighbouring columns with
/// the length of gravity are an accelerometer, and three columns that match the rotation of gravity
/// are a gyroscope.
///
/// @param block  the first rows: a vector for each column.
[[nodiscard]] TableColumns recognise_columns(const std::vector<std::string>& columns,
                                             std::string_view table,
                                             const LogBlock& block);

}  // namespace axiscal
