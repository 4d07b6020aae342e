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
  /// Of the same record, one for each point of the curve; NaN where tau is too long for them.
  std::map<OtherDeviation, std::vector<double>> others;
  NoiseModel model;
  Dwell dwell;
  std::string kind;      ///< of its sensor: "accelerometer", ...; empty: not known
  std::string unit;      ///< of the samples; empty: not known
  double rate_hz = 0.0;  ///< of its samples
};

/// The noise of a log at rest.
struct LogNoise {
  double rate_hz = 0.0;
  std::size_t samples = 0;  ///< 0: a curve without this value
  std::vector<ColumnNoise> columns;
  std::vector<std::string> warnings;  ///< problems of the log
};

/// The columns that are axes of one instrument and share a unit: their names differ only in the
/// last letter x, y or z. If there are several such instruments, those of a kind are chosen by the
/// start of their names (a, acc, g, gyr, m, mag, ..), else the first; all columns if the names are
/// not helpful.
/// @param kind  of instrument: "accelerometer", "gyroscope", "magnetometer", ...
/// @return not empty; pointers into `noise`.
[[nodiscard]] std::vector<const ColumnNoise*> columns_of_instrument(const LogNoise& noise,
                                                                    std::string_view kind);

/// @return the unit of a coefficient, "unit" standing for that of the samples: "unit/sqrt(Hz)".
[[nodiscard]] std::string noise_unit(NoiseKind kind, const std::string& unit = "unit");

/// The noise of an accelerometer and a gyroscope for Kalibr's imu.yaml: densities N and random
/// walks K, continuous-time, in SI units, root mean square over the three axes; and the rate of the
/// samples. If the record does not show a walk, its limit is given.
/// @throws RefusedError  if one of the two is missing, or of no unit that is known.
/// @par Source
/// github.com/ethz-asl/kalibr/wiki/IMU-Noise-Model; IEEE Std 952-1997, annex C.
[[nodiscard]] std::string kalibr_imu_yaml(const LogNoise& noise,
                                          const std::string& topic = "/imu0");

/// Writes and reads {"format": "axiscal-noise", "version": 1, ..}: curves, coefficients, dwell
/// times.
/// @throws DataError  `PATH: /json/pointer: ...`.
[[nodiscard]] std::string noise_json(const LogNoise& noise);
[[nodiscard]] LogNoise parse_noise(std::string_view text, const std::string& path);

}  // namespace axiscal
