// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "axiscal/logs/recording_file.hpp"

namespace axiscal {

/// A sensor of three axes in a recording.
struct RecordedSensor {
  SeriesKind kind = SeriesKind::other;
  int number = 0;                       ///< number within its kind, from 0
  std::size_t series = 0;               ///< position of its series in the summary
  std::array<std::size_t, 3> places{};  ///< positions of x, y, z among the series' columns
  std::array<std::string, 3> columns;   ///< names of x, y, z in the recording
  std::string name;  ///< name of the message, topic or table, with its instance: "sensor_accel[1]"
  std::string unit;  ///< empty if not known
  KnownBy known_by = KnownBy::nothing;
  double rate_hz = 0.0;  ///< NaN if not known
  std::size_t samples = 0;
  std::string device;         ///< the device id in the vehicle's software; may be empty
  bool is_corrected = false;  ///< true if the device that wrote the log corrected it
};

/// Finds the sensors of a recording that are suitable for calibration. These are left out: sensors
/// that do not vary, series with less than a fifth of the rate of the fastest series of their kind,
/// corrected series if there is a raw one, and guessed sensors if another one is known.
[[nodiscard]] std::vector<RecordedSensor> sensors_of(const RecordingSummary& summary);

/// @return true if no column of a series varies, because the sensor is dead or missing.
[[nodiscard]] bool is_constant(const SeriesSummary& series);

/// @return notes about the constant sensors that sensors_of() omits.
[[nodiscard]] std::vector<std::string> constant_sensor_notes(const RecordingSummary& summary);

/// @return "accelerometer 0: IMU (AccX, AccY, AccZ), m/s^2, 24.7 Hz; known by the file's format".
[[nodiscard]] std::string words_of(const RecordedSensor& sensor);

}  // namespace axiscal
