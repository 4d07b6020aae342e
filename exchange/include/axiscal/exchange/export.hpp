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

/// A file format in which other software reads a calibration.
struct ExportFormat {
  std::string_view name;         ///< "px4", "c-header", ...
  std::string_view description;  ///< the software that reads it
  std::string_view formula;  ///< formula by which that software computes the field from a reading v
  bool is_text = true;       ///< false: binary, which must not be printed to a terminal
};

/// @return the formats of this build, by name.
[[nodiscard]] std::span<const ExportFormat> export_formats();

/// The format of the numbers in a header.
struct HeaderNumbers {
  enum class Type { float64, float32, fixed };
  Type type = Type::float64;
  int reading_bits = 0;  ///< for `fixed`: number of fractional bits of a reading, 0 to 24
  int field_bits = 16;   ///< for `fixed`: number of fractional bits of the field, 0 to 28
};

/// @param text  "double", "float", "q16" (16 fractional bits of readings and field) or "q0:16" (0
///              fractional bits of the readings, 16 of the field).
/// @return the format of the numbers.
/// @throws DomainError  for another text.
[[nodiscard]] HeaderNumbers parse_header_numbers(std::string_view text);

struct ExportOptions {
  bool lossy = false;  ///< true: write the terms that the format can store, and report the loss
  /// Factor from the record's readings to the readings of the consumer's driver, e.g. m/s^2 per
  /// count. It is needed if the two units do not determine it.
  std::optional<double> reading_factor;
  std::optional<double> local_gravity;  ///< m/s^2 per g; needed if the record is in g and lacks it
  HeaderNumbers numbers;                ///< number type of c-header and cpp-header
  /// Prefix of the names in a header; empty: made from kind and slot: "axiscal_accelerometer_L".
  std::string name;
  int instance = 0;               ///< 1 for CAL_ACC1 or INS_ACC2; 0: the record's instance
  std::string digest;             ///< SHA-256 of the record, for the format `label`; may be empty
  CertificateDetails laboratory;  ///< for the format `dcc`: number, laboratory, customer, dates
};

/// The error of the consumer's field that is caused by terms that the format lacks. It is computed
/// for all directions of a field of the record's magnitude, and for the calibrated temperatures.
struct ExportLoss {
  std::vector<std::string> what;  ///< the missing terms: "cross-axis terms", "temperature", ...
  double worst = 0.0;             ///< largest difference of the fields [field unit]
  double rms = 0.0;
  double worst_deg = 0.0;  ///< largest angle between the fields
  double rms_deg = 0.0;
  std::string unit;  ///< unit of worst and rms
};

/// @return the loss as text: "cross-axis terms: without these, the field is up to 0.012 g and 0.7
///         degrees off (rms ...)".
[[nodiscard]] std::string loss_text(const ExportLoss& loss);

struct Exported {
  std::string content;
  std::optional<ExportLoss> loss;  ///< nullopt: the format contains the complete calibration
  std::vector<std::string> notes;  ///< the assumptions that were made, as text
};

/// Writes a calibration for other software. Text formats state the consumer's formula and units in
/// a comment.
///
/// @param format  one of export_formats().
/// @throws DomainError   for an unknown format, or a name that is not an identifier.
/// @throws RefusedError  if the format cannot store all terms and `lossy` is false, or if it does
///                       not support the instrument or its units.
[[nodiscard]] Exported export_calibration(const Calibration& calibration,
                                          std::string_view format,
                                          const ExportOptions& options = {});

/// Writes the sensors of a vehicle to one file, in the format "px4", "ardupilot" or "iio". Each
/// record has an instance (the number of the sensor) and a device (its id in the software).
/// @throws RefusedError  if the format allows only one instrument per file, or for the reasons of
///                       export_calibration().
[[nodiscard]] Exported export_vehicle(const std::vector<const Calibration*>& calibrations,
                                      std::string_view format,
                                      const ExportOptions& options = {});

/// Writes the accelerometer and the gyroscope of an IMU to one file, in one frame: format "kalibr".
///
/// @throws DomainError   for an unknown format.
/// @throws RefusedError  if the format allows only one instrument per file, both records have the
///                       same kind, they have different serial numbers, or for the reasons of
///                       export_calibration().
[[nodiscard]] Exported export_imu(const Calibration& first,
                                  const Calibration& second,
                                  std::string_view format,
                                  const ExportOptions& options = {});

}  // namespace axiscal
