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
  std::string name;  ///< name of the log, for messages
  std::vector<std::string> columns;
  LogBlock samples;                ///< one vector of samples for each column
  std::vector<std::string> notes;  ///< notes from reading the log; copied to the calibrations
};

/// States how the seats of the cube at the rests of a log are known. A seat is the pair of faces
/// that lie on the table and at the fence.
enum class Seats {
  unknown,     ///< the seats are not known: the instrument is a bare board, turned by hand
  sheet,       ///< the cube was placed in the order of a run sheet
  recognised,  ///< from the sensors: the accelerometer shows the face on the table; the gyroscope
               ///< or the magnetometer shows the face at the fence
};

/// The options for calibrating an IMU's log.
struct ImuOptions {
  std::vector<std::string> accelerometer;  ///< columns of the axes x, y, z, in this order
  std::vector<std::string> gyroscope;      ///< columns of x, y, z; empty if there is none
  std::vector<std::string> magnetometer;   ///< columns of x, y, z; empty if there is none
  /// Settings for calibrating the accelerometer: field (gravity), method, shape, weighting,
  /// positioner and others. `experiment.instrument` contains the serial number and the unit.
  Experiment experiment;
  /// The field of the magnetometer. If neither its magnitude, nor its vector, nor a site is given,
  /// the magnitude is 1, in units of the local field.
  FieldSetup magnetic_field;
  std::string gyroscope_unit = "1";
  std::string magnetometer_unit = "1";
  /// Options for finding rests. If `segment.columns` is empty, rests are detected in the columns of
  /// the gyroscope, or of the accelerometer if there is no gyroscope.
  SegmentOptions segment;
  Seats seats = Seats::unknown;
  std::vector<RunSheetRow> sheet;
  /// An existing calibration of the accelerometer, in the unit of the log's readings. It is used
  /// unchanged.
  std::optional<Calibration> known_accelerometer;
  std::optional<Face> first;  ///< fence face at the first rest; only for Seats::recognised
  TurnFitOptions turns;
};

/// A sensor of a log that could not be calibrated.
struct FailedSensor {
  std::string slot;     ///< "accelerometer", "gyroscope" or "magnetometer"
  std::string message;  ///< why the sensor could not be calibrated
};

/// Calibrations of an accelerometer, a gyroscope and a magnetometer in the accelerometer's frame.
struct ImuCalibration {
  Segmentation rests;
  std::optional<SeatLabels> seats;
  Calibration accelerometer;
  bool accelerometer_was_known = false;  ///< if true, records() omits the accelerometer
  bool accelerometer_failed = false;     ///< if true, records() omits it; see `failed` for why
  std::optional<Calibration> gyroscope;
  std::optional<Calibration> magnetometer;
  std::optional<TurnFit> turns;
  /// g-sensitivity of the gyroscope, which is the change of its bias per g of acceleration, and the
  /// standard errors of the elements; 3 x 3 [unit per g].
  std::optional<Eigen::Matrix3d> g_sensitivity, g_sensitivity_se;
  std::vector<FailedSensor> failed;  ///< sensors that could not be calibrated
  std::vector<std::string> notes;

  /// @return the calibrations that are to be written as records: accelerometer,
  ///         gyroscope and magnetometer, in this order. Sensors that failed and an accelerometer
  ///         that was known are omitted.
  [[nodiscard]] std::vector<Calibration> records() const;
};

/// Recognises how a cube lay at each rest. The accelerometer shows the face on the table. The face
/// at the fence follows from the gyroscope, whose readings are integrated from rest to rest, or
/// from the magnetometer if there is no gyroscope. Without either sensor, the fence faces are
/// assumed to follow the order of the standard design.
/// @param notes  receives a note that states how the fence faces were found.
/// @throws RefusedError  if resting_faces() or fit_turns() throws it, or if samples of a turn are
///                       missing and there is no magnetometer.
[[nodiscard]] SeatLabels recognise_seats(const RecordedLog& log,
                                         const Segmentation& rests,
                                         const ImuOptions& options,
                                         std::vector<std::string>& notes);

/// Compares the fence faces in `labels`, which come from a run sheet, with those that the gyroscope
/// or the magnetometer shows. Adds a message to `labels` for each rest whose fence face differs.
void check_fences(const RecordedLog& log,
                  const Segmentation& rests,
                  const ImuOptions& options,
                  SeatLabels& labels);

/// Calibrates the instruments of an IMU from one log of rests and the turns between them.
///
/// If the seats are not known, the function chooses the threshold between rest and motion that
/// gives the smallest expected error of the coefficients. The expected error is a standard
/// deviation times a factor. With a gyroscope, the standard deviation is that of the attitude
/// errors after the turns. Without one, it is that of the calibrated magnitudes of gravity. The
/// factor is large if the attitudes of the rests do not cover all directions.
///
/// If the seats are known, the accelerometer is calibrated from them. Otherwise the method
/// `magnitude` is used. The gyroscope is calibrated from the turns between rests (fit_turns()). The
/// magnetometer is calibrated like the accelerometer, and its frame is aligned with the
/// accelerometer's.
///
/// A gyroscope or a magnetometer that cannot be calibrated is listed in ImuCalibration::failed. The
/// other sensors are then calibrated without it.
///
/// @throws DataError     if a column is not in the log.
/// @throws RefusedError  if segment(), resting_faces() or calibrate() throws it; the message
///                       contains a remedy.
[[nodiscard]] ImuCalibration calibrate_imu(const RecordedLog& log, const ImuOptions& options);

}  // namespace axiscal
