// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/exchange/export.hpp"
#include "axiscal/instruments/instrument_kind.hpp"

namespace axiscal {

using Sensor = VehicleSensor;

/// Checks that the instrument has three axes, and that each responds to fields of both signs.
/// @param format  name of the format, for the message.
/// @throws RefusedError  for another instrument.
void require_three_axes(const Calibration& calibration, std::string_view format);

/// @return the type of the sensor: accelerometer, gyroscope or magnetometer.
/// @throws RefusedError  for another kind of instrument, or if require_three_axes() throws it.
Sensor sensor_of(const Calibration& calibration, std::string_view format);

/// @return the unit of the field: m/s^2, rad/s, or `of_magnetometer` for a magnetometer.
std::string usual_unit(Sensor sensor, const std::string& of_magnetometer);

/// The shapes that other software (the consumer) may prescribe for the matrix of a calibration.
enum class MatrixShape {
  full,
  symmetric,
  diagonal,  ///< one scale factor for each axis
  scalar,    ///< one scale factor for all axes
  identity,  ///< no matrix, only an offset
};

/// The formula of the other software (the consumer): field = inverse (reading - bias).
struct ConsumerModel {
  /// Unit: the consumer's unit of the field per its unit of the readings.
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity();
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  ///< in the consumer's unit of the readings
  /// Factor from the record's readings to the consumer's readings.
  double reading_factor = 1.0;
  /// Factor from the record's field to the consumer's field.
  double field_factor = 1.0;
  bool has_temperature = false;
  /// True if the consumer has temperature polynomials for the biases, but not for scale factors.
  bool has_bias_over_temperature = false;
  bool has_also = false;  ///< true: the consumer subtracts the response to the second field
};

/// The units of a consumer. An empty unit means the unit of the record.
struct ConsumerUnits {
  std::string reading;
  std::string field;
};

/// Computes the consumer's formula that is nearest to the calibration. Its matrix has the given
/// shape. The fit minimises the squared error over all directions of the field.
/// @throws RefusedError  if readings or field cannot be converted to the consumer's units.
ConsumerModel nearest_model(const Calibration& calibration,
                            const ConsumerUnits& units,
                            MatrixShape shape,
                            const ExportOptions& options);

/// If a magnetometer was calibrated in a field of magnitude 1 and unit "1", replaces the unit and
/// the magnitude of the field by those of the readings.
/// @return the changed calibration; for any other calibration, an unchanged copy.
Calibration with_measured_field(const Calibration& calibration);

/// @return the error that the missing terms of the model cause; nullopt if no terms are missing.
std::optional<ExportLoss> loss_of(const Calibration& calibration, const ConsumerModel& model);

/// Like loss_of(), but throws RefusedError if there is a loss and options.lossy is false.
std::optional<ExportLoss> accepted_loss(const Calibration& calibration,
                                        const ConsumerModel& model,
                                        std::string_view format,
                                        const ExportOptions& options);

/// @return one line about the record without control characters, for example "accelerometer 'A-17',
///         calibrated 2026-11-21T10:00:00Z by axiscal 0.1.0".
std::string source_line(const Calibration& calibration);

/// @return the lines of the comment in a file: source, status, formula, units and loss.
std::vector<std::string> comment_of(const Calibration& calibration,
                                    const std::vector<std::string>& lines,
                                    const std::optional<ExportLoss>& loss);

/// @return an example of a reading with its corrected value: "for example v = (0.1, 0, 9.9) becomes
///         (0.05, 0.01, 9.807)".
std::string worked_example(const Calibration& calibration, const ConsumerModel& model);

/// @return the lines of comment_of() as one text. Each line begins with the comment mark `mark`.
std::string comment_lines(const Calibration& calibration,
                          std::string_view mark,
                          const std::vector<std::string>& lines,
                          const std::optional<ExportLoss>& loss);

}  // namespace axiscal
