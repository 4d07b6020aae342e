// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/uncertainty_budget.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

/// The run whose scatter is looked at. All members outlive the search.
struct ScatterAnalysisInput {
  const Experiment& experiment;
  const SolvedReadings& fitted;  ///< the readings of the fit
  const SolvedReadings& judged;  ///< the same without errors that the readings share
  const MethodKind& method;
  const std::map<int, Eigen::Matrix3d>& mounts;  ///< turn in each mount that was fitted
  double mounts_expected = 0.0;                  ///< as MountTurns::expected
  bool has_mistake = false;                      ///< true if a mistake in the readings was named

  /// @return True if the readings show the response along fewer than three directions.
  [[nodiscard]] bool is_transfer() const { return fitted.set().seen.cols() > 0; }
};

/// An estimate with the causes that its uncertainty includes so far.
struct CountedEstimate {
  Estimate estimate;
  std::vector<UncertaintySource> weighed;  ///< share of each uncertain input in the covariance
  bool mounts_counted = false;             ///< True if the turns of the mounts are included.
  bool gains_differ = false;               ///< whether sensitivities differ between blocks
  bool by_lengths = false;                 ///< whether method faces took the lengths of the field
};

/// A cause of scatter that the scatter of the readings about the fit does not show: its test, its
/// columns or weights, its words and degrees of freedom. Each is one file and one line in
/// causes_of_scatter().
struct Cause {
  std::string_view name;
  bool changes_fit = false;  ///< it changes the coefficients' covariance itself, and is first
  /// Makes intervals longer, never shorter, and adds a note if it was found.
  CountedEstimate (*counted)(const ScatterAnalysisInput& run, CountedEstimate so_far) = nullptr;
};

/// @return all causes in the order in which they are counted.
[[nodiscard]] std::span<const Cause> causes_of_scatter();

/// Adds a cause of a program's own behind the others. Not while other threads calibrate.
void add_cause(const Cause& cause);

/// Counts the causes of scatter in the uncertainty of an estimate (method.md, sections 4 and 4.1).
/// @param estimate  of the methods paired, joint or known.
[[nodiscard]] CountedEstimate count_scatter(const ScatterAnalysisInput& run, Estimate estimate);

}  // namespace axiscal
