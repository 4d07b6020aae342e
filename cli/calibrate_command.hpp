// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/limits.hpp"
#include "axiscal/calib/run.hpp"
#include "experiment_options.hpp"
#include "log_input.hpp"

namespace axiscal::cli {

struct CalibrateCommand {
  ExperimentOptions experiment;
  std::optional<std::string> imu;  ///< file of a raw log, used instead of observations
  RestOptions rests;
  std::optional<std::string> accelerometer_unit, gyroscope_unit, magnetometer_unit,
      magnetic_magnitude, known_accelerometer;
  std::optional<std::string> only;  ///< slots of a log whose records are stored
  bool cube = false;
  bool fit_gyroscope_bias = false;
  std::optional<std::string> output;
  std::optional<std::string> limits, history, table, calibrated;
  std::optional<std::string> align;        ///< record of an instrument in the same recording
  std::optional<std::string> body, tare;   ///< for method attitude: earlier rotation and tare
  std::optional<std::string> shard;        ///< with `stream`: part I/N of the units
  std::optional<std::string> serial_from;  ///< file whose first line is the serial
  std::optional<std::string> store, station, batch;  ///< where records are stored, and their origin
  bool stream = false;                               ///< calibrate many units; one line per unit
  bool resume = false;  ///< with `stream`: keep complete lines of existing outputs
  bool each = false;    ///< make one record per file or serial number
  bool json = false;
  bool force = false;
  bool accept_suggestion = false;
  bool all = false;
};

/// Writes the records of `calibrate` to the files of the options, and prints tables and remarks.
///
/// @param heading  text printed before the tables.
/// @return the exit status: 1 if a record was refused or failed its limits, otherwise 0.
[[nodiscard]] int deliver_records(const CalibrateCommand& command,
                                  const std::vector<Calibration>& calibrations,
                                  const std::string& heading = "");

/// The result of one of several units.
struct Unit {
  std::string serial;
  std::string result;  ///< "pass", "fail", "ok", "warning", "refused", "error"
  std::string reason;
  std::vector<double> cells;  ///< value and standard uncertainty of each parameter, for the table
  std::string record;         ///< JSON of the record; empty if it is not stored
};

/// @return true if a Unit::result counts as good in a yield.
[[nodiscard]] bool is_good_result(std::string_view result);

/// Calibrates a unit. If the readings are refused, the result is "error".
/// @param parameters  names of the parameters; if empty, receives those of the unit's record.
[[nodiscard]] Unit calibrate_unit(const CalibrateCommand& command,
                                  const Experiment& experiment,
                                  const Run& run,
                                  const std::string& serial,
                                  const std::optional<Limits>& limits,
                                  const std::vector<Calibration>& earlier,
                                  std::vector<std::string>& parameters);

/// @return the JSON line for a unit without a record: {"format": "axiscal-refusal", ..}.
/// @param sha256  digest of the unit's readings.
[[nodiscard]] std::string refusal_json(const Unit& unit, const std::string& sha256);

/// The header line, and the line of one unit, in a table of units.
[[nodiscard]] std::string table_header(const std::vector<std::string>& parameters);
[[nodiscard]] std::string table_row(const Unit& unit, std::size_t parameters);

/// Runs `calibrate --stream`. @return the exit status.
[[nodiscard]] int run_stream(const CalibrateCommand& command);

/// Runs `calibrate --imu`. @return the exit status.
[[nodiscard]] int run_imu(const CalibrateCommand& command);

/// Runs `calibrate --method attitude`. @return the exit status.
[[nodiscard]] int run_attitude(const CalibrateCommand& command);

}  // namespace axiscal::cli
