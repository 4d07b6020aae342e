// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// @return the formats that import_calibration() reads in this build, by name.
[[nodiscard]] std::span<const std::string_view> import_formats();

struct ImportOptions {
  /// The sensor to read from the file: accelerometer, gyroscope or magnetometer.
  std::string kind = "accelerometer";
  int instance = 0;  ///< number of that sensor, e.g. 0 for CAL_ACC0
  /// Magnitude of the field for which the record is written [field unit of the format]: that of the
  /// place where the calibration will be checked. The default is 9.80665 m/s^2 for an
  /// accelerometer, 1 rad/s for a gyroscope, 0.5 G for a magnetometer.
  std::optional<double> magnitude;
};

/// Reads another program's calibration, for `check` and `apply`. Such files contain only
/// coefficients, so the record has no uncertainties.
///
/// @param text    content of the file.
/// @param path    the file's name in messages.
/// @param format  one of import_formats().
/// @throws DomainError  for an unknown format or kind.
/// @throws DataError    if the file is malformed or does not contain the sensor.
[[nodiscard]] Calibration import_calibration(std::string_view text,
                                             const std::string& path,
                                             std::string_view format,
                                             const ImportOptions& options = {});

}  // namespace axiscal
