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

/// Makes one table from a recording with several series. The table contains one sensor of each kind
/// (that with the number `format.instance`), and the further columns that `format` requests.
/// @param summary  summary of the first samples, which describes the series of the recording.
/// @param decoder  decoder of the recording, at the start of the file.
/// @param path     path of the recording, for messages.
/// @throws DataError  if the recording contains no sensor; the message lists its content.
[[nodiscard]] OpenedTable table_of_series(const std::string& path,
                                          const RecordingSummary& summary,
                                          DecoderPointer decoder,
                                          const LogFormat& format);

/// @return a list of the series of a recording for a message, such as "it contains sensor_baro,
///         sensor_accel (accelerometer), ...".
[[nodiscard]] std::string series_list(const RecordingSummary& summary);

}  // namespace axiscal
