// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/logs/imu.hpp"
#include "axiscal/logs/log_file.hpp"
#include "axiscal/logs/segment.hpp"
#include "command_line.hpp"

namespace axiscal::cli {

/// @return the parts of "a,b,c".
[[nodiscard]] std::vector<std::string> names_of(const std::string& text);

[[nodiscard]] LogFormat format_of(const LogOptions& options);

/// @return the options of segment(), but for its columns.
[[nodiscard]] SegmentOptions segment_options_of(const RestOptions& options);

/// @return the columns of the IMU's instruments, the sheet and what the turns need.
/// @param accelerometer  columns where the option does not state them.
[[nodiscard]] ImuOptions imu_options_of(const RestOptions& options,
                                        const std::vector<std::string>& accelerometer);

/// Reads a whole log into memory.
[[nodiscard]] RecordedLog record_log(const std::string& path, const LogOptions& options);

/// Prints notes, then warnings, to stderr.
void print_remarks_of(const Segmentation& rests,
                      const std::vector<std::string>& more_notes,
                      const SeatLabels* labels);

}  // namespace axiscal::cli
