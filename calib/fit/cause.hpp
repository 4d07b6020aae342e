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

/// The input of count_scatter(). The referenced objects must outlive the call.
struct ScatterAnalysisInput {
  const Experiment& experiment;
  const SolvedReadings& fitted;  ///< the readings of the fit
  const SolvedReadings& judged;  ///< the same readings minus the effect of shared errors
  const MethodKind& method;
  /// fitted rotation of the instrument in each mount
  const std::map<int, Eigen::Matrix3d>& mounts;
  double mounts_expected = 0.0;  ///< value of MountTurns::expected
  bool has_mistake = false;      ///< true if a mistake was found in the readings

  /// @return True if the readings show the response along fewer than three directions.
  [[nodiscard]] bool is_transfer() const { return fitted.set().seen.cols() > 0; }
};

/// An estimate with the causes that its uncertainty includes so far.
struct CountedEstimate {
  Estimate estimate;
  std::vector<UncertaintySource> weighed;  ///< share of each uncertain input in the covariance
  bool mounts_counted = false;             ///< True if the turns of the mounts are included.
  bool gains_differ = false;               ///< whether sensitivities differ between blocks
  bool by_lengths = false;                 ///< true if method faces used the length of the field
};

/// A cause of scatter that the residuals of the fit do not show. One source file contains its test,
/// its effect on the intervals and its note; causes_of_scatter() lists all causes.
struct Cause {
  std::string_view name;
  /// true if it changes the fit's covariance; such causes are counted first
  bool changes_fit = false;
  /// Returns `so_far` with the effect of the cause on the uncertainty. Intervals may become longer,
  /// never shorter. If the cause is significant, a note is added.
  CountedEstimate (*counted)(const ScatterAnalysisInput& run, CountedEstimate so_far) = nullptr;
};

/// @return all causes: the built-in ones, then those of add_cause(). count_scatter() applies the
///         causes with changes_fit before the others.
[[nodiscard]] std::span<const Cause> causes_of_scatter();

/// Appends a user-defined cause to the list. No other thread may calibrate during the call.
void add_cause(const Cause& cause);

/// Includes the causes of scatter in an estimate's uncertainty (method.md, sections 4 and 4.1).
/// @param estimate  the result of method paired, joint or known.
[[nodiscard]] CountedEstimate count_scatter(const ScatterAnalysisInput& run, Estimate estimate);

}  // namespace axiscal
