// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/fit.hpp"
#include "axiscal/calib/process_scatter.hpp"

namespace axiscal {

// What the readings' own scatter does not hold, one small file each; all of them make intervals
// longer where a run shows it, and say in the estimate's notes what was found (method.md, section
// 4). The intervals are filled.

/// Biases that differ from block to block.
/// @param process  what earlier calibrations say of that; null: nothing.
void add_block_scatter(const ReadingSet& set, const ProcessScatter* process, Estimate& estimate);

/// Consecutive readings that are alike.
void add_serial_correlation(StateOfRun& run, Estimate& estimate);

/// Sensitivities that differ from block to block, of which there are several.
/// @param mounts_known  whether it is known which readings were taken in which mount.
/// @return whether main entries do, as far as 5 % tells.
bool add_block_sensitivities(const Fit& run, bool mounts_known, Estimate& estimate);

/// Noise that is not the same along the field and across it (a field whose size jitters, or a cube
/// that is laid otherwise each time), and a field whose size wanders slowly over the run, or all
/// gains together.
/// @param gains_differ  between blocks, which was said already and looks like it.
void add_field_scatter(const Fit& run, bool gains_differ, Estimate& estimate);

}  // namespace axiscal
