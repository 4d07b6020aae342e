// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// What fit_magnitude() finds.
struct MagnitudeFit {
  LinearResponse response;          ///< bias [unit], sensitivity [unit per field unit]
  double degrees_of_freedom = 0.0;  ///< readings less nine
  double residual_sd = 0.0;         ///< scatter of |f|, for a reading of weight 1 [field unit]
};

/// The bare fit of readings to a field of constant magnitude: minimises sum w_i (|f_i| - F)^2 over
/// the variance of |f_i| for equal noise of the axes. No covariance, no correction, no check of the
/// orientations: for choosing among many fits. Method `magnitude` of calibrate() has all that.
///
/// @param readings  of three axes, n x 3, n of ten or more [unit].
/// @param F         magnitude of the field.
/// @param weights   n; empty: all 1.
/// @throws RefusedError  for fewer than ten readings, or one that is not finite.
/// @par Source
/// method.md, section 4, magnitude.
[[nodiscard]] AXISCAL_EXPORT MagnitudeFit
fit_magnitude(const Eigen::Ref<const Eigen::MatrixX3d>& readings,
              double F,
              MagnitudeShape shape = MagnitudeShape::symmetric,
              const Eigen::Ref<const Eigen::VectorXd>& weights = Eigen::VectorXd());

}  // namespace axiscal
