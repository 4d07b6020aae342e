// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/sensor_temperature.hpp"
#include "axiscal/core/boxed_optional.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/field_level.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// The attitude of an instrument, as stated by a dividing head, a sine plate or a tumble fixture.
struct StatedAttitude {
  double pitch_rad = 0.0;             ///< nose up is positive
  double roll_rad = 0.0;              ///< right side down is positive
  std::optional<double> heading_rad;  ///< clockwise from north; not needed for a vertical field
};

/// The data of one reading except its responses.
struct Reading {
  int run = 1;                                   ///< sequence number, in the order of measurement
  int block = 1;                                 ///< number that identifies the block of readings
  int mount = 1;                                 ///< number that identifies the mounting
  bool confirm = false;                          ///< true: not fitted, but used to test the fit
  std::optional<DesignPoint> point;              ///< rest face and fence face of the cube
  FieldLevel level;                              ///< factor that multiplies the induced field
  std::optional<SensorTemperature> temperature;  ///< outputs of temperature sensors, any unit
  std::optional<double> time_s;                  ///< time of the reading [s]
  /// The field in the frame `sensor`, if it is stated instead of `point` [field unit].
  BoxedOptional<Eigen::Vector3d> field_in_sensor;
  /// The attitude, if it is stated instead of `point` and `field_in_sensor`.
  BoxedOptional<StatedAttitude> attitude;
};

/// The readings of one run: n readings of an instrument with m axes.
struct AXISCAL_EXPORT Observations {
  std::vector<Reading> readings;               ///< n entries
  Eigen::MatrixXd response;                    ///< n x m [unit of the instrument]
  std::optional<Eigen::VectorXd> samples;      ///< number of samples averaged in each reading, n
  std::optional<Eigen::MatrixXd> response_sd;  ///< sd of the samples in a reading, n x m [unit]
  /// n x m: true if the axis is the difference of two columns, and one of these columns is at or
  /// beyond an end of its range in this reading.
  std::optional<Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>> saturated;
  bool has_block = false;  ///< true if blocks were stated
  bool has_level = false;  ///< true if levels were stated
  /// True if the fence faces were stated. If it is false, the fence faces in the points have no
  /// meaning, and the table must be level.
  bool has_fence = true;

  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(readings.size()); }
};

/// Joins the observations of several files of one run. Each file becomes one or more blocks. Run
/// numbers and block numbers continue from file to file.
///
/// @param parts  the observations of each file: at least one, with equal numbers of axes.
/// @throws DomainError  if `parts` is empty, if the numbers of axes differ, or if only some parts
///                      state samples or saturation.
[[nodiscard]] AXISCAL_EXPORT Observations concatenate(std::vector<Observations> parts);

/// @return the readings in these rows, in the order of `rows`.
[[nodiscard]] AXISCAL_EXPORT Observations select_rows(const Observations& observations,
                                                      const std::vector<std::size_t>& rows);

}  // namespace axiscal
