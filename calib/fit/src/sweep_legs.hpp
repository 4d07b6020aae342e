// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

/// Which way the temperature goes at each reading of a sweep: 1 on the way up, -1 on the way down.
/// It turns where it has come back from its extreme by a fifth of the range.
/// @param temperatures  in the order of the readings.
[[nodiscard]] Eigen::VectorXd sweep_directions(const Eigen::VectorXd& temperatures);

/// @return true if the temperature goes both ways, each over half of the range or more.
[[nodiscard]] bool is_bidirectional(const Eigen::VectorXd& temperatures,
                                    const Eigen::VectorXd& ways);

}  // namespace axiscal
