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
  /// the same readings minus the estimated effect of errors that several readings share
  const SolvedReadings& judged;
  const MethodKind& method;
  /// fitted rotation of the instrument in each mount, by mount number
  const std::map<int, Eigen::Matrix3d>& mounts;
  /// mean square that the fitted rotations of the mounts would have if they were only noise, see
  /// MountTurns::expected
  double mounts_expected = 0.0;
  bool has_mistake = false;  ///< true if a mistake was found in the readings

  /// @return true if the readings determine the response along fewer than three directions.
  [[nodiscard]] bool is_transfer() const { return fitted.set().seen.cols() > 0; }
};

/// An estimate, with flags for the sources of scatter that its uncertainty already includes.
struct CountedEstimate {
  Estimate estimate;
  /// contribution of each uncertain input to the covariance
  std::vector<UncertaintySource> weighed;
  bool mounts_counted = false;  ///< true if the uncertainty includes the mounts' rotations
  /// true if consecutive readings of a pose share an error, so that only their means are
  /// independent
  bool means_counted = false;
  /// true if all readings of a pose share an error, so that only the means of the poses are
  /// independent
  bool poses_counted = false;
  bool gains_differ = false;  ///< true if the sensitivities differ between blocks
  bool by_lengths = false;    ///< true if fit_face_lengths() replaced the estimate
};

/// A cause of scatter that the residuals of the fit do not show. One source file contains its test,
/// its effect on the intervals and its note; causes_of_scatter() lists all causes.
struct Cause {
  std::string_view name;
  /// true if the cause changes the covariance of the fit; such causes are applied first
  bool changes_fit = false;
  /// Adds the effect of the cause to the uncertainty of `so_far` and returns the result. Intervals
  /// may become longer, never shorter. If the cause is significant, a note is added.
  CountedEstimate (*counted)(const ScatterAnalysisInput& run, CountedEstimate so_far) = nullptr;
};

/// @return all causes: first the built-in ones, then those that add_cause() added. count_scatter()
///         applies the causes with changes_fit before the others.
[[nodiscard]] std::span<const Cause> causes_of_scatter();

/// Appends a user-defined cause to the list. No other thread may calibrate during the call.
void add_cause(const Cause& cause);

/// Adds the effects of all causes of scatter to the uncertainty of an estimate (method.md, sections
/// 4 and 4.1).
/// @param estimate  the result of method `paired`, `joint` or `known`.
[[nodiscard]] CountedEstimate count_scatter(const ScatterAnalysisInput& run, Estimate estimate);

}  // namespace axiscal
