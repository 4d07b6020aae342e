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
  std::optional<std::string> only;  ///< slots (sensors) whose records are stored; nullopt: all
  bool cube = false;
  bool fit_gyroscope_bias = false;
  std::optional<std::string> output;
  std::optional<std::string> limits, history, table, calibrated;
  /// record of a second instrument whose readings are in the same file as those of the first
  std::optional<std::string> align;
  /// For method `attitude`: `body` is the file of an earlier rotation, and `tare` is a file with
  /// readings that correct this rotation.
  std::optional<std::string> body, tare;
  std::optional<std::string> shard;        ///< for --stream: I/N, calibrate only part I of N parts
  std::optional<std::string> serial_from;  ///< file whose first line is the serial number
  /// The store of the records; the test station and the batch that are stored with each record.
  std::optional<std::string> store, station, batch;
  bool stream = false;  ///< one output line for each instrument
  bool resume = false;  ///< for --stream: keep the complete lines of existing outputs
  bool each = false;    ///< make one record per file or serial number
  bool json = false;
  bool force = false;
  bool accept_suggestion = false;
  bool all = false;
};

/// Writes the records to the files that the options name. Prints tables and remarks.
///
/// @param heading  text printed before the tables.
/// @return the exit status: 1 if a record was refused or does not meet its limits, otherwise 0.
[[nodiscard]] int deliver_records(const CalibrateCommand& command,
                                  const std::vector<Calibration>& calibrations,
                                  const std::string& heading = "");

/// The result for one of several instruments (units) that are calibrated by one call.
struct Unit {
  std::string serial;
  std::string result;  ///< "pass", "fail", "ok", "warning", "refused", "error"
  std::string reason;
  std::vector<double> cells;  ///< table row: value and standard uncertainty of each parameter
  std::string record;         ///< JSON of the record; empty if it is not stored
};

/// @return true if an instrument with this Unit::result counts as good in the yield.
[[nodiscard]] bool is_good_result(std::string_view result);

/// Calibrates one instrument (unit). If its readings cannot be calibrated, Unit::result is "error".
/// @param parameters  names of the parameters, for the header of a table. If the list is empty, it
///                    receives the names from this unit's record.
[[nodiscard]] Unit calibrate_unit(const CalibrateCommand& command,
                                  const Experiment& experiment,
                                  const Run& run,
                                  const std::string& serial,
                                  const std::optional<Limits>& limits,
                                  const std::vector<Calibration>& earlier,
                                  std::vector<std::string>& parameters);

/// @return the line of JSON for an instrument without a record: {"format": "axiscal-refusal", ..}.
/// @param sha256  digest of the instrument's readings.
[[nodiscard]] std::string refusal_json(const Unit& unit, const std::string& sha256);

/// table_header() returns the header line of a CSV table; table_row() returns the line of one unit.
[[nodiscard]] std::string table_header(const std::vector<std::string>& parameters);
[[nodiscard]] std::string table_row(const Unit& unit, std::size_t parameters);

/// Runs `calibrate --stream`. @return the exit status.
/// @param table  the options for the columns of the table of readings.
[[nodiscard]] int run_stream(const CalibrateCommand& command, const TableOptions& table);

/// Runs `calibrate --imu`. @return the exit status.
[[nodiscard]] int run_imu(const CalibrateCommand& command);

/// Runs `calibrate --method attitude`. @return the exit status.
[[nodiscard]] int run_attitude(const CalibrateCommand& command);

}  // namespace axiscal::cli
