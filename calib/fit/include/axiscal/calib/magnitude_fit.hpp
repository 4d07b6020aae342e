// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The result of fit_magnitude().
struct MagnitudeFit {
  LinearResponse response;          ///< bias [unit], sensitivity [unit per field unit]
  double degrees_of_freedom = 0.0;  ///< number of readings minus nine
  double residual_sd = 0.0;         ///< sd of |f| for a reading of weight 1 [field unit]
};

/// Fits bias and sensitivity to readings in a field of constant magnitude F. The fit minimises
/// sum w_i (|f_i| - F)^2 / var(|f_i|), where f_i is the calibrated reading. It assumes that all
/// axes have equal noise. It does not compute a covariance, correct the bias of the estimate, or
/// check the orientations. Use it to choose among many fits. For a calibration use calibrate() with
/// method `magnitude`, which also does these three steps.
///
/// @param readings  the readings of three axes, n x 3, n >= 10 [unit].
/// @param F         magnitude of the field [field unit].
/// @param weights   n weights of the readings; empty: all 1.
/// @throws RefusedError  for fewer than ten readings, or if a reading is not finite.
/// @par Source
/// method.md, section 4, magnitude.
[[nodiscard]] AXISCAL_EXPORT MagnitudeFit
fit_magnitude(const Eigen::Ref<const Eigen::MatrixX3d>& readings,
              double F,
              MagnitudeShape shape = MagnitudeShape::symmetric,
              const Eigen::Ref<const Eigen::VectorXd>& weights = Eigen::VectorXd());

}  // namespace axiscal
