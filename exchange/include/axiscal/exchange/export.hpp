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
  std::string_view formula;  ///< formula by which the reader computes the field from a reading v
  bool is_text = true;       ///< false: binary, not for a terminal
};

/// @return the formats of this build, by name.
[[nodiscard]] std::span<const ExportFormat> export_formats();

/// The format of the numbers in a header.
struct HeaderNumbers {
  enum class Type { float64, float32, fixed };
  Type type = Type::float64;
  int reading_bits = 0;  ///< fixed: binary places of readings, 0 to 24
  int field_bits = 16;   ///< fixed: binary places of the field, 0 to 28
};

/// @param text  "double", "float", "q16" (binary places of readings and field) or "q0:16" (of the
///              readings, of the field).
/// @return the format of the numbers.
/// @throws DomainError  for another text.
[[nodiscard]] HeaderNumbers parse_header_numbers(std::string_view text);

struct ExportOptions {
  bool lossy = false;  ///< true: write the terms that the format can store, and report the loss
  /// The reading of the consumer's driver for 1 unit of the record's readings, e.g. m/s^2 per
  /// count. It is needed if the units do not determine it.
  std::optional<double> reading_factor;
  std::optional<double> local_gravity;  ///< m/s^2 per g, for a record in g that does not state it
  HeaderNumbers numbers;                ///< number type of c-header and cpp-header
  /// Prefix of the names in a header; empty: by kind and slot, "axiscal_accelerometer_L".
  std::string name;
  int instance = 0;               ///< number of the sensor: 0 for CAL_ACC0, 2 for INS_ACC2
  std::string digest;             ///< SHA-256 of the record, for a label; may be empty
  CertificateDetails laboratory;  ///< further details of dcc: number, laboratory, customer, dates
};

/// The error of the field that the consumer computes, because the format lacks some terms. It is
/// computed for all directions of a field of the record's magnitude, and for the calibrated
/// temperatures.
struct ExportLoss {
  std::vector<std::string> what;  ///< "cross-axis terms", "temperature", ...
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
/// @throws RefusedError  if the format allows only one instrument per file; as
///                       export_calibration().
[[nodiscard]] Exported export_vehicle(const std::vector<const Calibration*>& calibrations,
                                      std::string_view format,
                                      const ExportOptions& options = {});

/// Writes the accelerometer and the gyroscope of an IMU to one file, in one frame: format "kalibr".
///
/// @throws DomainError   for an unknown format.
/// @throws RefusedError  if the format allows only one instrument per file, both records have the
///                       same kind, or they have different serial numbers; as export_calibration().
[[nodiscard]] Exported export_imu(const Calibration& first,
                                  const Calibration& second,
                                  std::string_view format,
                                  const ExportOptions& options = {});

}  // namespace axiscal
