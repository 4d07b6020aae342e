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
  int number = 0;                       ///< of its kind, counted from 0
  std::size_t series = 0;               ///< its place in the summary
  std::array<std::size_t, 3> places{};  ///< of x, y, z among the series' columns
  std::array<std::string, 3> columns;   ///< their names in the recording
  std::string name;  ///< of the message, topic or table, with its instance: "sensor_accel[1]"
  std::string unit;  ///< empty: not known
  KnownBy known_by = KnownBy::nothing;
  double rate_hz = 0.0;  ///< NaN where it is not known
  std::size_t samples = 0;
  std::string device;         ///< the device id in the vehicle's software; may be empty
  bool is_corrected = false;  ///< by a calibration of the device that wrote the log
};

/// The sensors of a recording that are worth using: of several series of one kind those that are
/// recorded fast, and the raw ones before those that the device has corrected.
[[nodiscard]] std::vector<RecordedSensor> sensors_of(const RecordingSummary& summary);

/// @return whether no column of a series varies: a sensor that is dead, or not there.
[[nodiscard]] bool is_constant(const SeriesSummary& series);

/// @return notes about constant sensors, which are omitted.
[[nodiscard]] std::vector<std::string> words_of_dead(const RecordingSummary& summary);

/// @return "accelerometer (IMU: AccX, AccY, AccZ in m/s^2, 24.7 Hz, known by the format)".
[[nodiscard]] std::string words_of(const RecordedSensor& sensor);

}  // namespace axiscal
