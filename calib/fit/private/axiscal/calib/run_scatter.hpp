// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/process_scatter.hpp"

namespace axiscal {

/// What a run's scatter is looked for in.
struct RunScatterSetup {
  const ReadingSet& set;                    ///< the readings that were fitted, with their effects
  bool known_field = false;                 ///< given, not fitted
  bool averages_pairs = false;              ///< as method paired does
  bool mounts_known = false;                ///< which readings were taken in which mount
  const ProcessScatter* process = nullptr;  ///< of earlier calibrations; null: none
};

/// Counts in the coefficients' uncertainty what the readings' own scatter does not hold: that
/// blocks differ in bias and sensitivity, that noise depends on the field, and that consecutive
/// readings are alike. Where they are the coefficients become means over models of the noise. Says
/// in the estimate's notes what was found.
///
/// @param estimate  of methods paired, joint and known; its intervals are filled.
/// @par Source
/// method.md, section 4.
void add_run_scatter(const RunScatterSetup& setup, Estimate& estimate);

}  // namespace axiscal
