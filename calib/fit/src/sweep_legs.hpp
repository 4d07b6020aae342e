// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

/// Returns for each reading of a sweep 1 if the temperature rises or -1 if it falls. The direction
/// changes at an extreme only if the temperature then moves back by at least a fifth of the whole
/// temperature range.
/// @param temperatures  the temperature at each reading, in the order of the readings.
[[nodiscard]] Eigen::VectorXd sweep_directions(const Eigen::VectorXd& temperatures);

/// @param ways  the directions from sweep_directions().
/// @return true if the rising readings and the falling readings each span at least half of the
///         temperature range.
[[nodiscard]] bool is_bidirectional(const Eigen::VectorXd& temperatures,
                                    const Eigen::VectorXd& ways);

}  // namespace axiscal
