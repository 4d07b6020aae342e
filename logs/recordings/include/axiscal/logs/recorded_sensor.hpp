// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "axiscal/logs/recording_file.hpp"

namespace axiscal {

/// A sensor with three axes in a recording.
struct RecordedSensor {
  SeriesKind kind = SeriesKind::other;
  int number = 0;                       ///< zero-based index among the sensors of this kind
  std::size_t series = 0;               ///< index of the sensor's series in RecordingSummary
  std::array<std::size_t, 3> places{};  ///< indices of the columns x, y, z in the series
  std::array<std::string, 3> columns;   ///< names of the columns x, y, z in the recording
  std::string name;  ///< name of the message, topic or table, with its instance: "sensor_accel[1]"
  std::string unit;  ///< empty if not known
  KnownBy known_by = KnownBy::nothing;
  double rate_hz = 0.0;  ///< NaN if not known
  std::size_t samples = 0;
  std::string device;         ///< device id from the log of PX4 or ArduPilot, or empty
  bool is_corrected = false;  ///< true if PX4 corrected the readings before it wrote the log
};

/// Finds the sensors of a recording that are suitable for calibration. A sensor is left out in
/// these cases:
/// - Its readings are constant.
/// - Its rate is less than a fifth of the highest rate among the sensors of its kind.
/// - Its readings are corrected, and there is a raw sensor of its kind.
/// - Its kind was guessed from the values, and a sensor of this kind is known by other evidence.
[[nodiscard]] std::vector<RecordedSensor> sensors_of(const RecordingSummary& summary);

/// @return true if all columns of a series are constant, which means a dead or missing sensor.
[[nodiscard]] bool is_constant(const SeriesSummary& series);

/// @return notes about the constant sensors that sensors_of() omits.
[[nodiscard]] std::vector<std::string> constant_sensor_notes(const RecordingSummary& summary);

/// @return a description such as "accelerometer 0: IMU (AccX, AccY, AccZ), m/s^2, 24.7 Hz;
///         recognised by the file's format".
[[nodiscard]] std::string words_of(const RecordedSensor& sensor);

}  // namespace axiscal
