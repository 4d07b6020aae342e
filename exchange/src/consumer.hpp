// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/exchange/export.hpp"
#include "axiscal/instruments/instrument_kind.hpp"

namespace axiscal {

using Sensor = VehicleSensor;

/// @throws RefusedError  unless the instrument has three axes that are not one-sided. `format` is
///                       used in the message.
void require_three_axes(const Calibration& calibration, std::string_view format);

/// @return the type of sensor: accelerometer, gyroscope or magnetometer.
/// @throws RefusedError  for another kind of instrument, or as require_three_axes().
Sensor sensor_of(const Calibration& calibration, std::string_view format);

/// @return the unit of a sensor's field: m/s^2, rad/s, or for a magnetometer `of_magnetometer`.
std::string usual_unit(Sensor sensor, const std::string& of_magnetometer);

/// The shape that a consumer allows for a calibration's matrix.
enum class MatrixShape {
  full,
  symmetric,
  diagonal,  ///< scale factors
  scalar,    ///< one scale factor for all axes
  identity,  ///< no matrix, only an offset
};

/// A consumer's formula: field = inverse (reading - bias).
struct ConsumerModel {
  /// [consumer's field unit per consumer's reading unit]
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity();
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  ///< [consumer's reading unit]
  double reading_factor = 1.0;                     ///< factor from the record's readings
  double field_factor = 1.0;                       ///< factor from the record's field
  bool has_temperature = false;
  /// True if the consumer corrects each bias for temperature by a polynomial, but not the scales.
  bool has_bias_over_temperature = false;
  bool has_also = false;  ///< true if the consumer subtracts the response to second fields
};

/// The units that a consumer uses; empty: those of the record.
struct ConsumerUnits {
  std::string reading;
  std::string field;
};

/// Computes the model that has a matrix of the given shape and is nearest to a calibration, by
/// least squares over all directions of the field.
/// @throws RefusedError  if readings or field do not convert to the consumer's units.
ConsumerModel nearest_model(const Calibration& calibration,
                            const ConsumerUnits& units,
                            MatrixShape shape,
                            const ExportOptions& options);

/// Changes the field of a magnetometer's calibration to the unit of the readings, if the field has
/// magnitude 1 and unit "1". The scales then keep the length of the readings.
/// @return the changed calibration, or a copy of any other calibration.
Calibration with_measured_field(const Calibration& calibration);

/// @return the error that is caused by terms that the model lacks; nullopt if it has all terms.
std::optional<ExportLoss> loss_of(const Calibration& calibration, const ConsumerModel& model);

/// As loss_of(), but throws RefusedError if there is a loss and options.lossy is false.
std::optional<ExportLoss> accepted_loss(const Calibration& calibration,
                                        const ConsumerModel& model,
                                        std::string_view format,
                                        const ExportOptions& options);

/// @return e.g. "accelerometer 'A-17', calibrated 2026-11-21T10:00:00Z by axiscal 0.1.0", in one
///         line without control characters.
std::string source_line(const Calibration& calibration);

/// @return the lines of a file's comment: source, status, formula, units, loss.
std::vector<std::string> comment_of(const Calibration& calibration,
                                    const std::vector<std::string>& lines,
                                    const std::optional<ExportLoss>& loss);

/// @return an example of a reading and its corrected value: "for example v = (0.1, 0, 9.9) becomes
///         (0.05, 0.01, 9.807)".
std::string worked_example(const Calibration& calibration, const ConsumerModel& model);

/// @return the lines of comment_of() as one text. Each line begins with `mark`.
std::string comment_lines(const Calibration& calibration,
                          std::string_view mark,
                          const std::vector<std::string>& lines,
                          const std::optional<ExportLoss>& loss);

}  // namespace axiscal
