// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "command_line.hpp"

namespace axiscal::cli {

/// Writes the records of `calibrate` where the options say, prints their tables and remarks.
///
/// @param heading  printed before the tables.
/// @return the exit status: 1 where one was refused or failed its limits.
[[nodiscard]] int deliver_records(const CalibrateCommand& command,
                                  const std::vector<Calibration>& calibrations,
                                  const std::string& heading = "");

}  // namespace axiscal::cli
