// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/process_scatter.hpp"

namespace axiscal {

/// Counts in the biases' uncertainty what the readings' own scatter does not hold: that blocks
/// differ, and that consecutive readings are alike. Where they are the biases become means over
/// models of the noise. Says in the estimate's notes what was found.
///
/// @param set       the readings that were fitted, with the run's effects.
/// @param process   what earlier calibrations say of the blocks' scatter; null: nothing.
/// @param estimate  of methods paired, joint and known; its intervals are filled.
/// @par Source
/// method.md, section 4.
void add_run_scatter(const ReadingSet& set, const ProcessScatter* process, Estimate& estimate);

}  // namespace axiscal
