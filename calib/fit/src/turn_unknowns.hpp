// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "axiscal/calib/turns.hpp"

namespace axiscal {

/// @param J  derivatives of the attitude errors with respect to the unknowns of a gyroscope.
/// @return true if an unknown is undetermined, or if it affects the turns so little that its
///         estimate is mainly noise.
[[nodiscard]] bool leaves_room(const Eigen::MatrixXd& J);

/// @param turns  number of turns, for the message.
/// @throws RankDeficientError  if the turns do not determine an unknown.
void require_determined(const Eigen::MatrixXd& J, const TurnFit& fit, std::size_t turns);

}  // namespace axiscal
