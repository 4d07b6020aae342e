// SPDX-License-Identifier: Apache-2.0
// The readings for goal 5 of bench/README.md, the fit to the magnitude only. The library and the
// programs to compare use the same readings.
#pragma once

#include <Eigen/Core>

inline constexpr int magnitude_reading_count = 200;

/// @return simulated readings, 200 x 3, in a field of magnitude 1 with random directions. The
///         sensor has a bias, a sensitivity of 2 and little noise.
const Eigen::MatrixX3d& magnitude_readings();
