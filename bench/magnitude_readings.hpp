// SPDX-License-Identifier: Apache-2.0
// The readings for the magnitude-only fit of goal 5 (README.md). The product and its peers use the
// same readings.
#pragma once

#include <Eigen/Core>

inline constexpr int magnitude_reading_count = 200;

/// 200 x 3: a field of length 1 in random directions, a bias, a sensitivity of 2 and a little
/// noise.
const Eigen::MatrixX3d& magnitude_readings();
