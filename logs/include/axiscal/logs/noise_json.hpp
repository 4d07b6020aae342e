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
  /// Further deviations of the same record, one for each point of `curve`; NaN if tau is too long.
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

/// Finds the columns that are axes of one instrument. Columns belong together if their names differ
/// only in the last letter x, y or z. The first instrument is used whose name suits `kind` (a, acc,
/// g, gyr, m, mag, ..). If no name suits, the first instrument is used, or all columns if no two
/// columns belong together.
/// @param kind  kind of the instrument: "accelerometer", "gyroscope", "magnetometer", ...
/// @return pointers to elements of `noise.columns`.
[[nodiscard]] std::vector<const ColumnNoise*> columns_of_instrument(const LogNoise& noise,
                                                                    std::string_view kind);

/// @param unit  unit of the samples.
/// @return the unit of a coefficient, for example "unit/sqrt(Hz)" for white noise.
[[nodiscard]] std::string noise_unit(NoiseKind kind, const std::string& unit = "unit");

/// @return Kalibr's imu.yaml for an accelerometer and a gyroscope: the continuous-time noise
///         densities N and random walks K in SI units, each the root mean square over the three
///         axes, and the sampling rate. If the record does not show a random walk, its upper bound
///         is written.
/// @throws RefusedError  if the accelerometer or the gyroscope is missing, its unit is not known,
///                       or its record shows no white noise.
/// @par Source
/// github.com/ethz-asl/kalibr/wiki/IMU-Noise-Model; IEEE Std 952-1997, annex C.
[[nodiscard]] std::string kalibr_imu_yaml(const LogNoise& noise,
                                          const std::string& topic = "/imu0");

/// Writes and reads noise as JSON, {"format": "axiscal-noise", "version": 1, ..}: curves,
/// coefficients and dwell times.
/// @throws DataError  with the message `PATH: /json/pointer: ...`.
[[nodiscard]] std::string noise_json(const LogNoise& noise);
[[nodiscard]] LogNoise parse_noise(std::string_view text, const std::string& path);

}  // namespace axiscal
