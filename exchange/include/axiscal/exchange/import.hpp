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
  /// accelerometer, gyroscope or magnetometer: which of the file's sensors.
  std::string kind = "accelerometer";
  int instance = 0;  ///< its number: CAL_ACC0
  /// The field's magnitude where it will be checked [unit of the format]; default: 9.80665 m/s^2
  /// for an accelerometer, 1 rad/s for a gyroscope, 0.5 G for a magnetometer.
  std::optional<double> magnitude;
};

/// Reads another program's calibration, for `check` and `apply`. Such files have coefficients only,
/// so the record lacks uncertainties.
///
/// @param text    content of the file.
/// @param path    its name, for messages.
/// @param format  one of import_formats().
/// @throws DomainError  for an unknown format or kind.
/// @throws DataError    if the file is malformed, or has no such sensor.
[[nodiscard]] Calibration import_calibration(std::string_view text,
                                             const std::string& path,
                                             std::string_view format,
                                             const ImportOptions& options = {});

}  // namespace axiscal
