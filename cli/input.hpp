// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/input_file.hpp"

namespace axiscal::cli {

/// A table of observations and the SHA-256 of its file.
struct ObservationsFile {
  ObservationsTable table;
  Observations beside;  ///< what the columns hold that were asked for beside them; else empty
  std::string sha256;
};

/// @param beside  columns of another instrument in the same rows.
/// @throws DataError  as read_observations().
[[nodiscard]] ObservationsFile read_observations_file(
    const std::string& path,
    const ObservationColumns& columns,
    const std::optional<ObservationColumns>& beside = {});

/// @return the SHA-256 of a file's bytes; empty for standard input and pipes,
///         which are read once only.
[[nodiscard]] std::string sha256_of_file(const std::string& path);

/// A reader of an open file; the file must outlive it.
[[nodiscard]] CsvReader csv_reader_of(InputFile& file,
                                      CsvReader::Quotes quotes = CsvReader::Quotes::span_lines);

/// @return a record that a result may rest on.
/// @throws RefusedError  if its calibration was refused, and `force` is not set.
[[nodiscard]] Calibration read_unrefused(const std::string& record, bool force);

}  // namespace axiscal::cli
