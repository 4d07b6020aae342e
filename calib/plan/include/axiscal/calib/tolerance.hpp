// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/positioner/design.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

/// How exactly a cube is made: standard deviations.
struct Tolerances {
  double foot_height_m = 0.0;   ///< the height of each ball along its face's normal
  double ball_radius_m = 0.0;   ///< the variation of each ball's radius
  double squareness_rad = 0.0;  ///< the turn of each face as a whole, about both of its edges
  double fence_rad = 0.0;       ///< the lean of the fence
};

/// Draws a cube that is made to a drawing within its tolerances.
/// @throws DomainError  if the tolerances are so wide that it is none.
[[nodiscard]] AXISCAL_EXPORT Positioner random_positioner(const CubeFeet& drawing,
                                                          const Surface& surface,
                                                          const Tolerances& tolerances,
                                                          RandomStream& random);

/// The covariance of such cubes' face normals, in closed form.
///
/// Of the contact plane n . c_i + r_i = d a foot that stands out by h_i, or is larger by h_i, turns
/// n by the gradient of the plane through the three h_i.
[[nodiscard]] AXISCAL_EXPORT NormalCovariance normal_covariance_of(const CubeFeet& drawing,
                                                                   const Tolerances& tolerances);

/// Root mean square errors of a calibration that takes the cube as drawn, in parts of the field.
/// Biases and sensitivities are divided by the axis's sensitivity.
struct CalibrationErrors {
  double bias = 0.0;
  double sensitivity = 0.0;  ///< error of each axis's main component
  double cross_axis = 0.0;   ///< error of its others
  /// Error of the field's direction by calibrated readings, any way, over attitudes.
  double angle_rad = 0.0;
};

/// The effect of a cube's tolerances on calibrations by one method.
struct ToleranceEffect {
  Method method = Method::paired;
  CalibrationErrors closed_form;  ///< linear in the tolerances; on a level table
  CalibrationErrors
      simulated;     ///< cubes made, seated, simulated and calibrated; on the table given
  int unusable = 0;  ///< number of cubes that could not lie at a point, or were not cubes
  double worst_angle_95_rad = 0.0;  ///< 95 % of the cubes have a smaller error in every attitude
};

struct ToleranceStudy {
  SensorModel nominal;              ///< instrument, field and response; three axes or more
  std::vector<DesignEntry> design;  ///< the points taken, one replicate
  CubeFeet drawing;
  Surface surface;
  Tolerances tolerances;
  Eigen::Vector2d slope =
      Eigen::Vector2d::Zero();  ///< the slope of the table, unknown to the calibration
  int trials = 1000;
  std::uint64_t seed = 1;
};

/// The errors that a cube's tolerances leave in calibrations, by each method that the design
/// allows.
///
/// Noise is left out; forecast() gives its effect. `known` assumes a level table, so the slope is
/// part of its error.
/// @return paired (where each point has its opposite), joint and known (where they are determined).
/// @throws DomainError  for fewer than 1 trial, a negative tolerance, or fewer than three axes.
/// @par Source
/// method.md, sections 9 and 10.
[[nodiscard]] AXISCAL_EXPORT std::vector<ToleranceEffect> study_tolerances(
    const ToleranceStudy& study);

}  // namespace axiscal
