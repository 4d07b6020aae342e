// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "axiscal/logs/noise_model.hpp"

namespace axiscal {

/// The noise of one column of a log.
struct ColumnNoise {
  std::string name;
  std::vector<AllanPoint> curve;
  NoiseModel model;
  Dwell dwell;
};

/// The noise of a log at rest.
struct LogNoise {
  double rate_hz = 0.0;
  std::size_t samples = 0;
  std::vector<ColumnNoise> columns;
  std::vector<std::string> warnings;  ///< what should be looked at in the log
};

/// @return the unit of a coefficient, "unit" standing for that of the samples: "unit/sqrt(Hz)".
[[nodiscard]] std::string noise_unit(NoiseKind kind);

/// Writes and reads {"format": "axiscal-noise", "version": 1, ..}: curves, coefficients, dwell
/// times.
/// @throws DataError  `PATH: /json/pointer: ...`.
[[nodiscard]] std::string noise_json(const LogNoise& noise);
[[nodiscard]] LogNoise parse_noise(std::string_view text, const std::string& path);

}  // namespace axiscal
