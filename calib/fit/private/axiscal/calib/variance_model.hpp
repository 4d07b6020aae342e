// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/linearised_run.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/process_scatter.hpp"

namespace axiscal {

/// Where a run's scatter is looked for: its readings as they were fitted, and the run linear about
/// the fit, made when somebody asks for it.
class ScatterSearch {
 public:
  /// @param set    the readings of the fit, with the run's effects.
  /// @param alone  the same without errors that readings share; both must outlive this.
  ScatterSearch(const ReadingSet& set, const ReadingSet& alone, const MethodKind& kind)
      : fitted(set), judged(alone), method(kind) {}

  const ReadingSet& fitted;
  const ReadingSet& judged;
  const MethodKind& method;
  bool mounts_known = false;                ///< which readings were taken in which mount
  double stated_step = 0.0;                 ///< of the readings; 0: as they show it
  const ProcessScatter* process = nullptr;  ///< of earlier calibrations; null: none
  bool gains_differ = false;                ///< between blocks, as one of the causes found

  [[nodiscard]] const LinearisedRun& run(const Estimate& estimate) {
    return run_ ? *run_ : run_.emplace(judged, estimate, method.directions_known);
  }

 private:
  std::optional<LinearisedRun> run_;
};

/// Counts the causes of scatter that the readings' own does not hold in the coefficients'
/// uncertainty, in turn, once seats, mounts and stated inputs are weighed: intervals become longer,
/// never shorter, and the estimate's notes say what was found. Where consecutive readings are alike
/// the biases become means over models of the noise.
///
/// @param estimate  of methods paired, joint and known.
/// @par Source
/// method.md, section 4.1.
void count_scatter(ScatterSearch& search, Estimate& estimate);

}  // namespace axiscal
