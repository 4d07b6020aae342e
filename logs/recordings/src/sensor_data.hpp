// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/logs/log_file.hpp"
#include "axiscal/logs/recording_file.hpp"

namespace axiscal {

/// What the columns of a table are.
struct TableColumns {
  std::vector<Series> series;       ///< one a column: kind, unit, known_by
  std::optional<std::size_t> time;  ///< column of times
  double seconds = 0.0;             ///< per unit of the times; 0 where nothing states it
};

/// Whether the name of a column tells nothing of what is in it: c4, x, ch2, data_3. Of others (a
/// quaternion, say) numbers alone are no proof.
[[nodiscard]] bool says_nothing(std::string_view name);

/// By names and units (SensorColumns), and where they say nothing by the first numbers: a column
/// that ascends evenly is the time; three neighbours whose length is that of gravity are an
/// accelerometer; three that turn it are a gyroscope.
///
/// @param block  the first rows, a column for each name.
[[nodiscard]] TableColumns recognise_columns(const std::vector<std::string>& columns,
                                             std::string_view table,
                                             const LogBlock& block);

}  // namespace axiscal
