// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

/// The direction of the temperature at each reading of a sweep: 1 for up, -1 for down. The
/// direction changes at an extreme from which the temperature then returns by a fifth of the range.
/// @param temperatures  the temperature at each reading, in the order of the readings.
[[nodiscard]] Eigen::VectorXd sweep_directions(const Eigen::VectorXd& temperatures);

/// @return true if the temperature goes both ways, each over half of the range or more.
[[nodiscard]] bool is_bidirectional(const Eigen::VectorXd& temperatures,
                                    const Eigen::VectorXd& ways);

}  // namespace axiscal
