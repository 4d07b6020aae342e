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
  std::optional<double> heading_rad;  ///< clockwise from north; a vertical field does without
};

/// The data of one reading besides its responses.
struct Reading {
  int run = 1;                                     ///< number of the reading, in the order taken
  int block = 1;                                   ///< replicate of the whole design
  int mount = 1;                                   ///< number of the instrument's mounting
  bool confirm = false;                            ///< left out of the fit, to test the fit
  std::optional<DesignPoint> point;                ///< the pose of the cube
  FieldLevel level;                                ///< multiple of the induced field
  std::optional<SensorTemperature> temperature;    ///< outputs of temperature sensors, any unit
  std::optional<double> time_s;                    ///< when it was taken [s]
  BoxedOptional<Eigen::Vector3d> field_in_sensor;  ///< instead of a design point [field unit]
  BoxedOptional<StatedAttitude> attitude;          ///< instead of either
};

/// The readings of one run: n readings of an instrument with m axes.
struct AXISCAL_EXPORT Observations {
  std::vector<Reading> readings;               ///< n
  Eigen::MatrixXd response;                    ///< n x m [unit of the instrument]
  std::optional<Eigen::VectorXd> samples;      ///< number of samples averaged in each reading, n
  std::optional<Eigen::MatrixXd> response_sd;  ///< their standard deviations, n x m [same unit]
  /// n x m: readings of a differential axis one of whose two columns is at or beyond the range.
  std::optional<Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>> saturated;
  bool has_block = false;  ///< whether blocks, levels were stated
  bool has_level = false;
  /// True if the fence faces were stated. If not, those of the points are meaningless, and the
  /// table must be level.
  bool has_fence = true;

  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(readings.size()); }
};

/// Puts several files of one run together: each is a block (or several), runs are numbered on.
///
/// @param parts  at least one; all with the same number of axes.
/// @throws DomainError  if there are none, their numbers of axes differ, or only some of them state
///                      samples.
[[nodiscard]] AXISCAL_EXPORT Observations concatenate(std::vector<Observations> parts);

/// @return the readings of some rows, in that order.
[[nodiscard]] AXISCAL_EXPORT Observations select_rows(const Observations& observations,
                                                      const std::vector<std::size_t>& rows);

}  // namespace axiscal
