// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/turns.hpp"
#include "axiscal/logs/segment.hpp"

namespace axiscal {

/// A log that is held in memory.
struct RecordedLog {
  std::string name;  ///< for messages
  std::vector<std::string> columns;
  LogBlock samples;                ///< a column for each name
  std::vector<std::string> notes;  ///< notes of the reader; they go into the records
};

/// The source of the labels for the seats of a log.
enum class Seats {
  unknown,     ///< a bare board turned by hand
  sheet,       ///< a cube, in the order of a run sheet
  recognised,  ///< a cube: rest faces by the accelerometer, fence faces by gyroscope or
               ///< magnetometer
};

/// The options for calibrating an IMU's log.
struct ImuOptions {
  std::vector<std::string> accelerometer;  ///< three columns, in the frame's order x, y, z
  std::vector<std::string> gyroscope;      ///< three, or none
  std::vector<std::string> magnetometer;   ///< three, or none
  /// Of the accelerometer: field (gravity), method, shape, weighting, positioner, ...; its
  /// instrument states serial and unit.
  Experiment experiment;
  /// The magnetometer's; without a magnitude and a site its field is 1, in units of the local one.
  FieldSetup magnetic_field;
  std::string gyroscope_unit = "1";
  std::string magnetometer_unit = "1";
  SegmentOptions segment;  ///< its columns: the gyroscope's by default, or the accelerometer's
  Seats seats = Seats::unknown;
  std::vector<RunSheetRow> sheet;
  /// An existing calibration of the accelerometer, in the unit of the log's readings. It is used
  /// unchanged.
  std::optional<Calibration> known_accelerometer;
  std::optional<Face> first;  ///< the first rest's fence face, where seats are recognised
  TurnFitOptions turns;
};

/// A sensor of a log that could not be calibrated.
struct FailedSensor {
  std::string slot;     ///< "gyroscope", ...
  std::string message;  ///< why
};

/// A magnetometer, an accelerometer and a gyroscope in one frame, the accelerometer's.
struct ImuCalibration {
  Segmentation rests;
  std::optional<SeatLabels> seats;
  Calibration accelerometer;
  bool accelerometer_was_known = false;  ///< then records() leaves it out
  bool accelerometer_failed = false;     ///< as above; `failed` gives the reason
  std::optional<Calibration> gyroscope;
  std::optional<Calibration> magnetometer;
  std::optional<TurnFit> turns;
  /// The change of the gyroscope's rests with gravity, 3 x 3 [unit per g], and its standard errors.
  std::optional<Eigen::Matrix3d> g_sensitivity, g_sensitivity_se;
  std::vector<FailedSensor> failed;  ///< the others are calibrated without them
  std::vector<std::string> notes;

  /// @return the records that were made: slots accelerometer, gyroscope, magnetometer.
  [[nodiscard]] std::vector<Calibration> records() const;
};

/// Recognises how a cube lay at each rest: rest faces by the accelerometer, fence faces by the
/// gyroscope integrated from rest to rest, else by the magnetometer, else in turn.
/// @param notes  says which.
/// @throws RefusedError  as resting_faces(), fit_turns().
[[nodiscard]] SeatLabels recognise_seats(const RecordedLog& log,
                                         const Segmentation& rests,
                                         const ImuOptions& options,
                                         std::vector<std::string>& notes);

/// Compares the labels of a run sheet with the fence faces seen by gyroscope or magnetometer.
/// Messages name the rests that disagree.
void check_fences(const RecordedLog& log,
                  const Segmentation& rests,
                  const ImuOptions& options,
                  SeatLabels& labels);

/// Calibrates the instruments of an IMU from one log of rests and the turns between them.
///
/// The threshold that tells rest from motion is that whose rests serve best: the scatter of
/// gravity's magnitude, with a gyroscope of the attitudes after the turns, times how far scatter
/// goes into the coefficients where so many rests lie in such directions. The accelerometer is
/// calibrated by its seats where they are known, else by method magnitude; the gyroscope from the
/// turns between rests (fit_turns); the magnetometer like the accelerometer, its frame turned to
/// the accelerometer's.
///
/// A gyroscope or a magnetometer that cannot be calibrated is named in `failed`, and the others are
/// calibrated as if it were not there.
///
/// @throws DataError     for columns that are not there.
/// @throws RefusedError  as segment(), calibrate() and label_by_sheet(), with a remedy.
[[nodiscard]] ImuCalibration calibrate_imu(const RecordedLog& log, const ImuOptions& options);

}  // namespace axiscal
