// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/fit.hpp"
#include "axiscal/calib/method_kind.hpp"

namespace axiscal {

/// Where a run's scatter is looked for: its readings as they were fitted, and the run linear about
/// the fit, made when somebody asks for it.
class ScatterSearch {
 public:
  /// @param set    the readings of the fit, with the run's effects.
  /// @param alone  the same without errors that readings share; all must outlive this.
  ScatterSearch(const Experiment& of, StateOfRun& set, StateOfRun& alone, Method by)
      : experiment(of),
        fitted_state(set),
        fitted(set.set()),
        judged(alone.set()),
        method(method_kind(by)),
        judged_state_(alone) {}

  const Experiment& experiment;
  StateOfRun& fitted_state;
  const ReadingSet& fitted;
  const ReadingSet& judged;
  const MethodKind& method;
  std::map<int, Eigen::Matrix3d> mounts;  ///< how the instrument is turned in each that was fitted
  double mounts_expected = 0.0;           ///< of their turns by noise, as MountStep has it

  std::vector<UncertaintySource> weighed;  ///< what each uncertain input leaves in the coefficients
  bool mounts_known = false;               ///< what comes of the mounts is counted
  bool gains_differ = false;               ///< between blocks, as one of the causes found

  [[nodiscard]] const Fit& run(const Estimate& estimate) {
    return run_ ? *run_ : run_.emplace(judged_state_, estimate);
  }

  /// @return what is fitted of the readings alone.
  [[nodiscard]] StateOfRun& judged_state() { return judged_state_; }

  /// Frees it.
  void forget_run() { run_.reset(); }

 private:
  StateOfRun& judged_state_;
  std::optional<Fit> run_;
};

/// Counts the causes of scatter that the readings' own does not hold in the coefficients'
/// uncertainty, in turn: inputs and seats, which the coefficients are fitted with anew, mounts,
/// soaks, rounding, blocks, the field's size, consecutive readings that are alike. Intervals become
/// longer, never shorter, and the estimate's notes say what was found. Where readings are alike the
/// biases become means over models of the noise.
///
/// @param estimate  of methods paired, joint and known.
/// @par Source
/// method.md, sections 4 and 4.1.
void count_scatter(ScatterSearch& search, Estimate& estimate);

}  // namespace axiscal
