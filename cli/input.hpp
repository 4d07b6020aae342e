// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "table_options.hpp"

namespace axiscal::cli {

/// A table of observations with the SHA-256 of its file.
struct ObservationsFile {
  Run run;
  Observations beside;  ///< values of further requested columns; otherwise empty
};

/// The options for reading a table of observations.
struct TableReading {
  TableOptions options;
  /// Kind of the instrument: other columns may stand in for its axes, as open_table(); empty:
  /// never.
  std::string kind;
  std::string unit;          ///< of the readings that is wanted, as WantedColumns; empty: any
  std::string faces_of;      ///< as WantedColumns
  std::string of_recording;  ///< likewise
};

/// @param beside  columns of another instrument in the same rows.
/// @throws DataError  as read_observations().
[[nodiscard]] ObservationsFile read_observations_file(
    const std::string& path,
    const ObservationColumns& columns,
    const std::optional<ObservationColumns>& beside = {},
    const TableReading& reading = {});

/// @return the SHA-256 of a text, in hexadecimal digits.
[[nodiscard]] std::string sha256_of_text(const std::string& text);

/// @return a source of bytes that are in memory; the text must outlive it.
[[nodiscard]] std::function<std::size_t(char* buffer, std::size_t size)> reader_of(
    const std::string& text);

/// @return the SHA-256 of a file's bytes; empty for standard input and pipes,
///         which are read once only.
[[nodiscard]] std::string sha256_of_file(const std::string& path);

/// @return a record that a result may rest on.
/// @throws RefusedError  if its calibration was refused, and `force` is not set.
[[nodiscard]] Calibration read_unrefused(const std::string& record, bool force);

}  // namespace axiscal::cli
