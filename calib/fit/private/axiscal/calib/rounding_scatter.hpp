// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/state_of_run.hpp"

namespace axiscal {

/// Counts in the coefficients' uncertainty that readings are rounded to steps wider than their
/// noise: the same pose then rounds the same way each time, and readings of one digit share an
/// error. Says in the estimate's notes which axes are so.
///
/// @param of           the readings that were fitted.
/// @param stated_step  of the readings [unit]; 0: as they show it.
/// @param estimate     of methods paired, joint and known; its intervals are filled.
/// @par Source
/// method.md, section 4.1.
void add_rounding_scatter(StateOfRun& of, double stated_step, Estimate& estimate);

/// @return whether the readings' step is so wide beside an axis's scatter that what is left of them
///         is the step's, not noise.
[[nodiscard]] bool is_coarsely_rounded(const ReadingSet& set,
                                       double stated_step,
                                       const Eigen::VectorXd& residual_sd);

}  // namespace axiscal
