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

/// A form in which other software takes a calibration.
struct ExportFormat {
  std::string_view name;         ///< "px4", "c-header", ...
  std::string_view description;  ///< who reads it
  std::string_view formula;  ///< formula by which the reader computes the field from a reading v
  bool is_text = true;       ///< false: not for a terminal
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

/// @return "double", "float", "q16" (both), "q0:16" (readings, field) as numbers.
/// @throws DomainError  for another text.
[[nodiscard]] HeaderNumbers parse_header_numbers(std::string_view text);

struct ExportOptions {
  bool lossy = false;  ///< write what the format holds, and say what is lost
  /// Output of the consumer's driver for one unit of the record's readings, if the units do not
  /// determine it: m/s^2 per count.
  std::optional<double> reading_factor;
  std::optional<double> local_gravity;  ///< m/s^2 per g, for a record in g without this value
  HeaderNumbers numbers;                ///< number type of c-header and cpp-header
  /// Prefix of the names in a header; empty: by kind and slot, "axiscal_accelerometer_L".
  std::string name;
  int instance = 0;               ///< number of the sensor: CAL_ACC0, INS_ACC2
  CertificateDetails laboratory;  ///< further details of dcc: number, laboratory, customer, dates
};

/// The error of the consumer's field, because the format lacks some terms: over all directions of a
/// field of the record's magnitude and over the calibrated temperatures.
struct ExportLoss {
  std::vector<std::string> what;  ///< "cross-axis terms", "temperature", ...
  double worst = 0.0;             ///< |difference of the fields| [field unit]
  double rms = 0.0;
  double worst_deg = 0.0;  ///< angle between them
  double rms_deg = 0.0;
  std::string unit;  ///< unit of worst and rms
};

/// @return "cross-axis terms, temperature: up to 0.012 g and 0.7 degrees (rms ...)".
[[nodiscard]] std::string loss_text(const ExportLoss& loss);

struct Exported {
  std::string content;
  std::optional<ExportLoss> loss;  ///< nothing: all that was calibrated is in it
  std::vector<std::string> notes;  ///< the assumptions, in words
};

/// Writes a calibration for other software. Text formats say the consumer's formula and units in a
/// comment.
///
/// @param format  one of export_formats().
/// @throws DomainError   for an unknown format, or a name that is not an identifier.
/// @throws RefusedError  where the format cannot hold the calibration and `lossy` is not set, or
///                       cannot take this instrument or its units at all.
[[nodiscard]] Exported export_calibration(const Calibration& calibration,
                                          std::string_view format,
                                          const ExportOptions& options = {});

/// The sensors of a vehicle in one file: formats "px4", "ardupilot", "iio". Each record has an
/// instance, the number of the sensor, and a device, its id in the software.
/// @throws RefusedError  where the format takes one instrument a file; as export_calibration().
[[nodiscard]] Exported export_vehicle(const std::vector<const Calibration*>& calibrations,
                                      std::string_view format,
                                      const ExportOptions& options = {});

/// An IMU's accelerometer and gyroscope in one file and one frame: format "kalibr".
///
/// @throws DomainError   for an unknown format.
/// @throws RefusedError  where the format takes one instrument a file, the two are of one kind or
///                       of two units; else as export_calibration().
[[nodiscard]] Exported export_imu(const Calibration& first,
                                  const Calibration& second,
                                  std::string_view format,
                                  const ExportOptions& options = {});

}  // namespace axiscal
