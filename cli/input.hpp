// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "table_options.hpp"

namespace axiscal::cli {

/// A table of observations, and the readings of a second instrument in the same file.
struct ObservationsFile {
  Run run;
  Observations beside;  ///< readings of the second instrument; empty if it is not requested
};

/// The options for reading a table of observations.
struct TableReading {
  TableOptions options;
  /// Kind of the instrument whose columns are recognised (see WantedColumns::kind). If it is empty,
  /// only the columns that the options state are used.
  std::string kind;
  /// Unit to which readings are converted (see WantedColumns::unit). If it is empty, readings are
  /// not converted.
  std::string unit;
  /// Kind of the instrument. If it is not empty, columns that name faces in words, for example "X
  /// up", are read as labels of poses (see WantedColumns::faces_of).
  std::string faces_of;
  /// Kind of the instrument. If it is not empty, the readings may come from the sensor of this kind
  /// in a recording (see WantedColumns::of_recording).
  std::string of_recording;
};

/// Opens a table of observations from a function, to read it row by row.
/// @param read  function that returns the bytes of the table.
/// @throws DataError  if open_table() throws it.
[[nodiscard]] OpenTable open_observations(
    const std::string& path,
    const ObservationColumns& columns,
    const TableReading& reading,
    const std::function<std::size_t(char* buffer, std::size_t size)>& read);

/// Reads a table of observations and computes the SHA-256 of its file.
/// @param beside  columns of a second instrument in the same rows.
/// @throws DataError  if the file is not a valid table of observations.
[[nodiscard]] ObservationsFile read_observations_file(
    const std::string& path,
    const ObservationColumns& columns,
    const std::optional<ObservationColumns>& beside = {},
    const TableReading& reading = {});

/// @return the SHA-256 of a text, in hexadecimal digits.
[[nodiscard]] std::string sha256_of_text(const std::string& text);

/// @return a function that reads the bytes of a text. The text must outlive the function.
[[nodiscard]] std::function<std::size_t(char* buffer, std::size_t size)> reader_of(
    const std::string& text);

/// @return the SHA-256 of a file's bytes; empty for standard input and pipes, because they can be
///         read only once.
[[nodiscard]] std::string sha256_of_file(const std::string& path);

/// Reads a record for use in a computation.
/// @throws RefusedError  if its calibration was refused, and `force` is false.
[[nodiscard]] Calibration read_unrefused(const std::string& record, bool force);

}  // namespace axiscal::cli
