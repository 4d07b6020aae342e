// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "axiscal/logs/log_file.hpp"
#include "logs/recordings/src/log_source.hpp"
#include "logs/recordings/src/series_decoder.hpp"

namespace axiscal {

struct OpenedTable {
  std::unique_ptr<LogFile::Source> source;
  std::vector<LogSensor> sensors;
};

/// A recording of several series as one table: the sensors of one instance, and further requested
/// columns.
/// @param summary  of its first samples, by which it is seen what it holds.
/// @param decoder  at its beginning.
/// @param path     for messages.
/// @throws DataError  if it holds no sensor; the message says what it holds.
[[nodiscard]] OpenedTable table_of_series(const std::string& path,
                                          const RecordingSummary& summary,
                                          DecoderPointer decoder,
                                          const LogFormat& format);

/// @return the content of a recording, in a line for a message: "it holds sensor_baro (4 columns),
///         ...".
[[nodiscard]] std::string series_list(const RecordingSummary& summary);

}  // namespace axiscal
