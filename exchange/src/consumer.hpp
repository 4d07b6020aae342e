// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/exchange/export.hpp"
#include "axiscal/instruments/instrument_kind.hpp"

namespace axiscal {

using Sensor = VehicleSensor;

/// @throws RefusedError  for other than three axes, or one-sided ones; `format` is for the message.
void require_three_axes(const Calibration& calibration, std::string_view format);

/// @return which of the three an instrument is.
/// @throws RefusedError  for another kind, other than three axes, or one-sided ones; `format` is
///                       for the message.
Sensor sensor_of(const Calibration& calibration, std::string_view format);

/// @return the unit of a sensor's field: m/s^2, rad/s, and the usual units of magnetic fields.
std::string usual_unit(Sensor sensor, const std::string& of_magnetometer);

/// The shape that a consumer allows for a calibration's matrix.
enum class MatrixShape {
  full,
  symmetric,
  diagonal,  ///< scale factors
  scalar,    ///< one scale factor for all axes
  identity,  ///< none: an offset only
};

/// A consumer's formula: field = inverse (reading - bias).
struct ConsumerModel {
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity();  ///< [its field unit per reading unit]
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();         ///< [its reading unit]
  double reading_factor = 1.0;                            ///< its reading per the record's
  double field_factor = 1.0;                              ///< its field per the record's
  bool has_temperature = false;
  bool has_bias_over_temperature = false;  ///< a polynomial of the biases, and no scales
  bool has_also = false;                   ///< whether second fields are taken out
};

/// The units that a consumer works in; empty: those of the record.
struct ConsumerUnits {
  std::string reading;
  std::string field;
};

/// The model of a shape that comes nearest: least squares over all directions of the field.
/// @throws RefusedError  where readings or field do not convert to the consumer's units.
ConsumerModel nearest_model(const Calibration& calibration,
                            const ConsumerUnits& units,
                            MatrixShape shape,
                            const ExportOptions& options);

/// A magnetometer's calibration whose field is in units of an unknown local one, with the field in
/// the readings' unit instead, so that its scales keep the length that was read; others as they
/// are.
Calibration with_measured_field(const Calibration& calibration);

/// The part of the calibration that the model leaves out, if any.
std::optional<ExportLoss> loss_of(const Calibration& calibration, const ConsumerModel& model);

/// loss_of(), refused unless losses are allowed.
std::optional<ExportLoss> accepted_loss(const Calibration& calibration,
                                        const ConsumerModel& model,
                                        std::string_view format,
                                        const ExportOptions& options);

/// "accelerometer 'A-17', calibrated 2026-11-21T10:00:00Z by axiscal 0.1.0", in one line without
/// control characters.
std::string source_line(const Calibration& calibration);

/// The comment of a file, line by line: source, status, formula, units, loss.
std::vector<std::string> comment_of(const Calibration& calibration,
                                    const std::vector<std::string>& lines,
                                    const std::optional<ExportLoss>& loss);

/// How one reading becomes the corrected value, with numbers: "for example v = (0.1, 0, 9.9)
/// becomes (0.05, 0.01, 9.807)".
std::string worked_example(const Calibration& calibration, const ConsumerModel& model);

/// The same as a comment in a file that marks them by `mark`.
std::string comment_lines(const Calibration& calibration,
                          std::string_view mark,
                          const std::vector<std::string>& lines,
                          const std::optional<ExportLoss>& loss);

}  // namespace axiscal
