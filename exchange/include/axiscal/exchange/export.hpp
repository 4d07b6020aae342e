// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/certificate_details.hpp"

namespace axiscal {

/// A file format that other software reads as a calibration.
struct ExportFormat {
  std::string_view name;         ///< for example "px4" or "c-header"
  std::string_view description;  ///< the software that reads the format
  std::string_view formula;  ///< formula by which this software computes the field from a reading v
  bool is_text = true;       ///< false: a binary format, which must not be printed to a terminal
};

/// @return the formats of this build, sorted by name.
[[nodiscard]] std::span<const ExportFormat> export_formats();

/// The number type of the coefficients in a C or C++ header.
struct HeaderNumbers {
  enum class Type { float64, float32, fixed };
  Type type = Type::float64;
  int reading_bits = 0;  ///< for `fixed`: fractional bits of a reading, 0 to 24
  int field_bits = 16;   ///< for `fixed`: fractional bits of the field, 0 to 28
};

/// @param text  "double"; "float"; "q16" for 16 fractional bits of readings and field; or "q0:16"
///              for 0 fractional bits of the readings and 16 of the field.
/// @return the format of the numbers.
/// @throws DomainError  for another text.
[[nodiscard]] HeaderNumbers parse_header_numbers(std::string_view text);

struct ExportOptions {
  bool lossy = false;  ///< true: store the terms that the format allows, and report the loss
  /// Factor from the record's readings to the readings of the driver in the other software, for
  /// example m/s^2 per count. It is required if it cannot be computed from the two units.
  std::optional<double> reading_factor;
  std::optional<double> local_gravity;  ///< local gravity [m/s^2]; required for a record in g that
                                        ///< does not state it
  HeaderNumbers numbers;                ///< number type for c-header and cpp-header
  /// Prefix of the names in a header. If it is empty, kind and slot form the prefix, for example
  /// "axiscal_accelerometer_L".
  std::string name;
  /// Zero-based number of the sensor; for example, 1 writes CAL_ACC1 (PX4) or INS_ACC2 (ArduPilot).
  /// If it is 0, the number in the record is used.
  int instance = 0;
  std::string digest;             ///< SHA-256 of the record, for the format `label`; may be empty
  CertificateDetails laboratory;  ///< details of the certificate in the format `dcc`
};

/// The error of the field that other software computes because the format cannot store some terms
/// of the calibration. The error is evaluated for all directions of a field of the record's
/// magnitude and for the calibrated temperatures.
struct ExportLoss {
  std::vector<std::string> what;  ///< names of the missing terms, for example "cross-axis terms"
  double worst = 0.0;             ///< largest magnitude of the error of the field
  double rms = 0.0;
  double worst_deg = 0.0;  ///< largest angle between the true field and the computed field
  double rms_deg = 0.0;
  std::string unit;  ///< unit of `worst` and `rms`
};

/// @return the loss as text, for example "cross-axis terms: without these, the field is up to 0.012
///         g and 0.7 degrees off (rms ...)".
[[nodiscard]] std::string loss_text(const ExportLoss& loss);

struct Exported {
  std::string content;
  std::optional<ExportLoss> loss;  ///< nullopt: the format contains the complete calibration
  std::vector<std::string> notes;  ///< assumptions of the export, as text for the user
};

/// Writes a calibration for other software. A text format states in a comment the formula and the
/// units of that software.
///
/// @param format  one of export_formats().
/// @throws DomainError   if the format is unknown, or the name is not an identifier.
/// @throws RefusedError  if the format cannot store all terms and `lossy` is false, or if it does
///                       not support the instrument or its units.
[[nodiscard]] Exported export_calibration(const Calibration& calibration,
                                          std::string_view format,
                                          const ExportOptions& options = {});

/// Writes the sensors of a vehicle to one file, in the format "px4", "ardupilot" or "iio". Each
/// record states the instance (zero-based number of the sensor) and the device (id of the sensor in
/// the software).
/// @throws RefusedError  if the format allows only one instrument per file, or if
///                       export_calibration() throws it.
[[nodiscard]] Exported export_vehicle(const std::vector<const Calibration*>& calibrations,
                                      std::string_view format,
                                      const ExportOptions& options = {});

/// Writes the accelerometer and the gyroscope of an IMU to one file in the format "kalibr". Both
/// sensors are described in the same frame.
///
/// @throws DomainError   if the format is unknown.
/// @throws RefusedError  if the format allows only one instrument per file, the records have the
///                       same kind or different serial numbers, or export_calibration() throws it.
[[nodiscard]] Exported export_imu(const Calibration& first,
                                  const Calibration& second,
                                  std::string_view format,
                                  const ExportOptions& options = {});

}  // namespace axiscal
