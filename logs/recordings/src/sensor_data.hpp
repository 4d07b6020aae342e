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
  std::vector<Series> series;       ///< for each column: kind, unit and known_by
  std::optional<std::size_t> time;  ///< column of times
  double seconds = 0.0;             ///< seconds per unit of the times; 0 if unknown
};

/// @return true if the name of a column has no meaning: c4, x, ch2, data_3. Columns with other
///         names (for example a quaternion) are not recognised by their values.
[[nodiscard]] bool is_generic_name(std::string_view name);

/// Recognises columns by names and units (SensorColumns). If these do not show a sensor, the values
/// in the first rows are used. The first column is the time if it increases in even steps. Three
/// neighbouring columns with the magnitude of gravity are an accelerometer. Three columns that
/// match the rotation of gravity are a gyroscope. If there is no accelerometer, three columns with
/// the magnitude of the Earth's magnetic field are a magnetometer.
///
/// @param block  the first rows of the table, with a vector for each column.
[[nodiscard]] TableColumns recognise_columns(const std::vector<std::string>& columns,
                                             std::string_view table,
                                             const LogBlock& block);

}  // namespace axiscal
