// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "calib/regression/gauss_newton.hpp"
#include "calib/regression/serial_correlation.hpp"

namespace axiscal {

/// Whether the deviations of a recording, in their order, are more alike than white noise by one
/// sided 10 %, and what follows for the unknowns if so: their change and their covariance as means
/// over models of such noise.
///
/// @param at_solution  deviations, as functions of the unknowns.
/// @param along        n x 3: how each deviation changes with the three axes' readings.
/// @return nothing where they are not alike.
[[nodiscard]] std::optional<CorrelatedFit> noise_of_recording(const Linearised& at_solution,
                                                              const Eigen::MatrixX3d& along);

}  // namespace axiscal
