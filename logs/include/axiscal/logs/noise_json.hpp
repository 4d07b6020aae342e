// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/logs/noise_model.hpp"
#include "axiscal/logs/other_deviations.hpp"

namespace axiscal {

/// The noise of one column of a log.
struct ColumnNoise {
  std::string name;
  std::vector<AllanPoint> curve;
  /// Variants of the Allan deviation, one value for each point of `curve`; NaN if tau is too long.
  std::map<OtherDeviation, std::vector<double>> others;
  NoiseModel model;
  Dwell dwell;
  std::string kind;      ///< kind of the sensor: "accelerometer", ...; empty if not known
  std::string unit;      ///< unit of the samples; empty if not known
  double rate_hz = 0.0;  ///< sampling rate of this column; 0 if not known
};

/// The noise of a log at rest.
struct LogNoise {
  double rate_hz = 0.0;
  std::size_t samples = 0;  ///< number of samples; 0 if not known
  std::vector<ColumnNoise> columns;
  std::vector<std::string> warnings;  ///< problems of the log
};

/// Finds the columns that are axes of one instrument. Columns belong to one instrument if their
/// names differ only in the last letter x, y or z. Of several instruments, the first one whose name
/// matches `kind` is chosen (a, acc, g, gyr, m, mag, ..). If no name matches, the first instrument
/// is chosen. If the names show no instrument with several columns, all columns are returned.
/// @param kind  kind of the instrument: "accelerometer", "gyroscope", "magnetometer", ...
/// @return pointers to elements of `noise.columns`.
[[nodiscard]] std::vector<const ColumnNoise*> columns_of_instrument(const LogNoise& noise,
                                                                    std::string_view kind);

/// @param unit  unit of the samples.
/// @return the unit of the noise coefficient of a kind, for example "unit/sqrt(Hz)" for white
///         noise.
[[nodiscard]] std::string noise_unit(NoiseKind kind, const std::string& unit = "unit");

/// @return the file imu.yaml of Kalibr for an accelerometer and a gyroscope. It contains the
///         sampling rate, the continuous-time noise densities N and the random walks K in SI units.
///         N and K are root mean squares over the three axes. If an axis does not show a random
///         walk, the upper bound of its K is used.
/// @throws RefusedError  if the accelerometer or the gyroscope is missing, if its unit is not
///                       known, or if it shows no white noise.
/// @par Source
/// github.com/ethz-asl/kalibr/wiki/IMU-Noise-Model; IEEE Std 952-1997, annex C.
[[nodiscard]] std::string kalibr_imu_yaml(const LogNoise& noise,
                                          const std::string& topic = "/imu0");

/// noise_json() writes noise as JSON, and parse_noise() reads it: {"format": "axiscal-noise",
/// "version": 1, ..}. The JSON contains curves, coefficients and dwell times.
/// @throws DataError  with the message `PATH: /json/pointer: ...`.
[[nodiscard]] std::string noise_json(const LogNoise& noise);
[[nodiscard]] LogNoise parse_noise(std::string_view text, const std::string& path);

}  // namespace axiscal
