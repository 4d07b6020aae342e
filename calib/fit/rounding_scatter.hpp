// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// @return True if the rounding step is wide relative to an axis's scatter: then the residuals are
///         rounding errors, not noise.
[[nodiscard]] bool is_coarsely_rounded(const ReadingSet& set,
                                       double stated_step,
                                       const Eigen::VectorXd& residual_sd);

}  // namespace axiscal
