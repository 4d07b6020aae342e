// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/recording_noise.hpp"

namespace axiscal {

std::optional<CorrelatedFit> noise_of_recording(const Linearised& at_solution,
                                                const Eigen::MatrixX3d& along) {
  constexpr Eigen::Index fewest_left = 4;
  // For longer recordings the jackknife, which leaves out one tenth of the readings at a time, is
  // sufficient. Their correlations may also exceed the range of the models.
  constexpr Eigen::Index most = 5000;
  const Eigen::Index n = at_solution.jacobian.rows();
  if (n < at_solution.jacobian.cols() + fewest_left || n > most ||
      !(lag_one_score(at_solution.jacobian, at_solution.residuals, along) > alike_above)) {
    return std::nullopt;
  }
  return fit_with_correlated_noise(at_solution.jacobian, -at_solution.residuals, along);
}

}  // namespace axiscal
