// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "calib/regression/gauss_newton.hpp"
#include "calib/regression/serial_correlation.hpp"

namespace axiscal {

/// Tests whether the deviations of a recording, in order, are more correlated than white noise
/// (one-sided, 10 %). If they are, the unknowns are estimated with several models of correlated
/// noise. The result is the mean change of the unknowns over the models, and its covariance.
///
/// @param at_solution  deviations, and their Jacobian with respect to the unknowns.
/// @param along        n x 3: the derivative of each deviation with respect to the three axes'
///                     readings.
/// @return nullopt if the deviations are not correlated.
[[nodiscard]] std::optional<CorrelatedFit> noise_of_recording(const Linearised& at_solution,
                                                              const Eigen::MatrixX3d& along);

}  // namespace axiscal
