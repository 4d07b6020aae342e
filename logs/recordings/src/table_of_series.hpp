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

/// Makes one table of a recording with several series. It contains the sensors of one instance, and
/// the further columns that `format` requests.
/// @param summary  summary of the first samples, which shows the series of the recording.
/// @param decoder  decoder of the recording that has not read anything yet.
/// @param path     path of the recording, for messages.
/// @throws DataError  if the recording contains no sensor; the message lists its content.
[[nodiscard]] OpenedTable table_of_series(const std::string& path,
                                          const RecordingSummary& summary,
                                          DecoderPointer decoder,
                                          const LogFormat& format);

/// @return the names of the series of a recording, for a message: "it contains sensor_baro,
///         sensor_accel (accelerometer), ...".
[[nodiscard]] std::string series_list(const RecordingSummary& summary);

}  // namespace axiscal
