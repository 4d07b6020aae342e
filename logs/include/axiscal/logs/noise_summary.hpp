// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/logs/noise_json.hpp"

namespace axiscal {

/// A coefficient of noise as data sheets print it.
struct SheetNoise {
  double value = 0.0;  ///< 0: the record does not show it
  double low = 0.0;    ///< 95 % interval; for 0 `high` is the bound below which it is hidden
  double high = 0.0;
  std::string unit;
};

/// N, B or K of a column in the units of data sheets: of a gyroscope deg/sqrt(h), deg/h and
/// deg/h/sqrt(h); of an accelerometer ug/sqrt(Hz), ug and ug/sqrt(s) (g of 9.80665 m/s^2); of a
/// magnetometer nT/sqrt(Hz), nT and nT/sqrt(s). Where the unit of the samples is not known, in
/// that unit.
/// @param kind  white, bias_instability or random_walk; others are left in the samples' unit.
[[nodiscard]] SheetNoise sheet_noise(const ColumnNoise& column, NoiseKind kind);

/// @return "0.101 [0.100, 0.102]", or "< 0.05" where the record shows a bound alone; "-" without.
[[nodiscard]] std::string sheet_text(const SheetNoise& noise);

/// The noise of a log in a table: a row for each column, N, B and K with their 95 % intervals;
/// plain text of 80 columns.
[[nodiscard]] std::string noise_summary(const LogNoise& noise);

}  // namespace axiscal
