// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/logs/noise_json.hpp"

namespace axiscal {

/// A noise coefficient in the unit of data sheets.
struct SheetNoise {
  double value = 0.0;  ///< the coefficient; 0 if the record does not show this noise
  double low = 0.0;    ///< lower end of the 95 % confidence interval
  double high = 0.0;   ///< upper end of the interval; an upper bound if `value` is 0
  std::string unit;
};

/// @return the coefficient N, B or K of a column in the units of data sheets. Gyroscope:
///         deg/sqrt(h), deg/h and deg/h/sqrt(h). Accelerometer: ug/sqrt(Hz), ug and ug/sqrt(s),
///         with g = 9.80665 m/s^2. Magnetometer: nT/sqrt(Hz), nT and nT/sqrt(s). If the unit of the
///         samples is not recognised, the coefficient stays in that unit.
/// @param kind  white (N), bias_instability (B) or random_walk (K). Coefficients of other kinds
///              stay in the unit of the samples.
[[nodiscard]] SheetNoise sheet_noise(const ColumnNoise& column, NoiseKind kind);

/// @return the value and its 95 % interval as text, such as "0.101 [0.100, 0.102]"; "< 0.05" if
///         only an upper bound is known; "-" if no bound is known.
[[nodiscard]] std::string sheet_text(const SheetNoise& noise);

/// @return the noise of a log as a plain-text table, at most 80 characters wide. Each row contains
///         the noise coefficients N, B and K of one column, with their 95 % intervals.
[[nodiscard]] std::string noise_summary(const LogNoise& noise);

}  // namespace axiscal
