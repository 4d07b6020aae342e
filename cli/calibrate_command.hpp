// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "experiment_options.hpp"
#include "log_input.hpp"

namespace axiscal::cli {

struct CalibrateCommand {
  ExperimentOptions experiment;
  std::optional<std::string> imu;  ///< a raw log instead of observations
  RestOptions rests;
  std::optional<std::string> accelerometer_unit, gyroscope_unit, magnetometer_unit,
      magnetic_magnitude, known_accelerometer;
  std::optional<std::string> only;  ///< slots of a log whose records are wanted
  bool cube = false;
  bool fit_gyroscope_bias = false;
  std::optional<std::string> output;
  std::optional<std::string> limits, history, table, calibrated;
  std::optional<std::string> align;       ///< record of an instrument that was recorded together
  std::optional<std::string> body, tare;  ///< method attitude: an earlier rotation, and its tare
  bool each = false;                      ///< a record of each file, or of each serial
  bool json = false;
  bool force = false;
  bool accept_suggestion = false;
  bool all = false;
};

/// Writes the records of `calibrate` where the options say, prints their tables and remarks.
///
/// @param heading  printed before the tables.
/// @return the exit status: 1 where one was refused or failed its limits.
[[nodiscard]] int deliver_records(const CalibrateCommand& command,
                                  const std::vector<Calibration>& calibrations,
                                  const std::string& heading = "");

/// `calibrate --imu`.
[[nodiscard]] int run_imu(const CalibrateCommand& command);

/// `calibrate --method attitude`.
[[nodiscard]] int run_attitude(const CalibrateCommand& command);

}  // namespace axiscal::cli
