// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// @return whether the readings' step is so wide beside an axis's scatter that what is left of them
///         is the step's, not noise.
[[nodiscard]] bool is_coarsely_rounded(const ReadingSet& set,
                                       double stated_step,
                                       const Eigen::VectorXd& residual_sd);

}  // namespace axiscal
