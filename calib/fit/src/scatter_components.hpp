// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/linearised_run.hpp"

namespace axiscal {

// What the readings' own scatter does not hold, one small file each; all of them make intervals
// longer where a run shows it, and say in the estimate's notes what was found (method.md, section
// 4). The intervals are filled.

/// Sensitivities that differ from block to block.
/// @param mounts_known  whether it is known which readings were taken in which mount.
/// @return whether main entries do, as far as 5 % tells.
bool add_block_sensitivities(const LinearisedRun& run, bool mounts_known, Estimate& estimate);

/// Noise that is not the same along the field and across it: a field whose size jitters, or a cube
/// that is laid otherwise each time.
void add_field_noise(const LinearisedRun& run, Estimate& estimate);

/// A field whose size, or gain that, wanders slowly over the run.
void add_field_wander(const LinearisedRun& run, Estimate& estimate);

}  // namespace axiscal
