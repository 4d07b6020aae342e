// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// @return the formats that import_calibration() reads in this build, sorted by name.
[[nodiscard]] std::span<const std::string_view> import_formats();

struct ImportOptions {
  /// Kind of the sensor to read from the file: accelerometer, gyroscope or magnetometer.
  std::string kind = "accelerometer";
  int instance = 0;  ///< zero-based number of the sensor, for example 0 for CAL_ACC0
  /// Magnitude of the field that the new record will state, in the format's unit of field. Use the
  /// magnitude at the place where the calibration will be checked. Default: 9.80665 m/s^2 for an
  /// accelerometer, 1 rad/s for a gyroscope, 0.5 G for a magnetometer.
  std::optional<double> magnitude;
};

/// Reads a calibration of another program, so that `check` and `apply` can use it. Such files
/// contain only coefficients, so the record has no uncertainties.
///
/// @param text    content of the file.
/// @param path    file name for messages.
/// @param format  one of import_formats().
/// @throws DomainError  if the format or the kind is unknown.
/// @throws DataError    if the file is malformed or does not contain the sensor.
[[nodiscard]] Calibration import_calibration(std::string_view text,
                                             const std::string& path,
                                             std::string_view format,
                                             const ImportOptions& options = {});

}  // namespace axiscal
