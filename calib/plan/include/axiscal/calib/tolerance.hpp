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

/// The tolerances of a cube, as standard deviations.
struct Tolerances {
  double foot_height_m = 0.0;   ///< position of each ball's centre along the face's normal
  double ball_radius_m = 0.0;   ///< radius of each ball
  double squareness_rad = 0.0;  ///< rotation of each face about each of its two edge directions
  double fence_rad = 0.0;       ///< angle by which the fence leans over the table
};

/// Returns a random cube, as if it were made from the drawing with these tolerances.
/// @throws DomainError  if the tolerances are so wide that the balls do not form a cube.
[[nodiscard]] AXISCAL_EXPORT Positioner random_positioner(const CubeFeet& drawing,
                                                          const Surface& surface,
                                                          const Tolerances& tolerances,
                                                          RandomStream& random);

/// The covariance of the face normals of cubes with these tolerances, in closed form.
///
/// The contact plane of a face, with the normal n and the distance d from the cube's centre,
/// touches three balls with the centres c_i and the radii r_i: n . c_i + r_i = d. If foot i is
/// higher by h_i, or its ball's radius is larger by h_i, the normal n rotates by an angle equal to
/// the gradient of the plane through the three h_i.
[[nodiscard]] AXISCAL_EXPORT NormalCovariance normal_covariance_of(const CubeFeet& drawing,
                                                                   const Tolerances& tolerances);

/// Root mean square errors of a calibration that assumes the cube of the drawing. Errors of biases
/// and sensitivities are divided by the norm |S_k| of the axis's sensitivity.
struct CalibrationErrors {
  double bias = 0.0;         ///< [field unit]
  double sensitivity = 0.0;  ///< relative error of each axis's main component
  double cross_axis = 0.0;   ///< relative error of each of the axis's other two components
  /// Error of the field's direction that calibrated readings give, for each of the two components
  /// perpendicular to the field, averaged over all attitudes.
  double angle_rad = 0.0;
};

/// The effect of a cube's tolerances on calibrations by one method.
struct ToleranceEffect {
  Method method = Method::paired;
  CalibrationErrors closed_form;  ///< errors to first order in the tolerances, for a level table
  /// Errors from simulated cubes, for the stated slope of the table.
  CalibrationErrors simulated;
  /// Number of simulated cubes that could not lie at a design point or were not valid cubes.
  int unusable = 0;
  /// 95 % quantile, over the simulated cubes, of the largest error of the field's direction over
  /// all attitudes.
  double worst_angle_95_rad = 0.0;
};

struct ToleranceStudy {
  SensorModel nominal;              ///< instrument, field and response; three axes or more
  std::vector<DesignEntry> design;  ///< the design points of one replicate
  CubeFeet drawing;
  Surface surface;
  Tolerances tolerances;
  Eigen::Vector2d slope =
      Eigen::Vector2d::Zero();  ///< the slope of the table, unknown to the calibration
  int trials = 1000;
  std::uint64_t seed = 1;
};

/// Computes the errors that a cube's tolerances cause in calibrations, for each method that the
/// design allows.
///
/// Noise of the readings is not simulated; forecast() gives its effect. Method `known` assumes a
/// level table, so its error includes the effect of the slope.
/// @return the effects for the methods `paired`, `joint` and `known`, without those that the design
///         does not determine.
/// @throws DomainError  for fewer than 1 trial, a negative tolerance, or fewer than three axes.
/// @par Source
/// method.md, sections 9 and 10.
[[nodiscard]] AXISCAL_EXPORT std::vector<ToleranceEffect> study_tolerances(
    const ToleranceStudy& study);

}  // namespace axiscal
