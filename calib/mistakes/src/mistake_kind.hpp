// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/correction.hpp"
#include "calib/mistakes/src/suspect_run.hpp"

namespace axiscal {

// Prior ranges of the parameters of the mistake models (docs/method/mistakes.md). The ranges for a
// wrong value and for a drift are fractions of the full response.
inline constexpr double angle_range_rad = 0.08;
inline constexpr double value_range = 4.0;
inline constexpr double drift_range = 0.04;

// A reading is at an end of an axis's range if the axis's fitted response to the field exceeds this
// fraction of the largest response at that end.
inline constexpr double end_of_range = 0.9;

/// One explanation of a bad fit.
struct Explanation {
  double likelihood = 0.0;  // natural logarithm of the likelihood
  HypothesisFit fit;
  Correction correction;
  std::string words;  // the words after "run 7 fits 3 times better "
};

/// The explanations of a run, in the order in which they were added.
class Explanations {
 public:
  /// Adds an explanation if its fit succeeded and has at least one degree of freedom.
  /// @param fit           the fit under the explanation.
  /// @param ranges        the range of each parameter that the explanation adds.
  /// @param alternatives  the number of explanations of the same kind.
  /// @param surely        number that is added to the log-likelihood because of evidence other than
  ///                      the fit.
  void add(HypothesisFit fit,
           const std::vector<double>& ranges,
           double alternatives,
           Correction correction,
           std::string words,
           double surely = 0.0);

  /// @return all explanations, the most likely first.
  [[nodiscard]] std::vector<Explanation> ranked() &&;

 private:
  std::vector<Explanation> all_;
};

/// The advice to the user in the warning of a mistake.
struct MistakeAdvice {
  WarningCode code;
  std::string_view one;   // advice for one reading, or for the whole run
  std::string_view many;  // advice for several readings; if empty, `one` is used
};

/// The properties of a hypothesis that its nested F test uses.
struct CandidateHypothesis {
  double tests = 1.0;     ///< the number of similar hypotheses
  bool of_few = false;    ///< true if the hypothesis concerns a few readings
  double at_least = 0.0;  ///< lower bound of the p-value, from another test
};
using Consider = std::function<void(const HypothesisFit& with, const CandidateHypothesis& how)>;

/// A kind of mistake: its detection, its explanation of a reading or of the run, and its remedy. If
/// a kind (for example a wrong pose) has no detection of its own, the test that leaves readings out
/// detects it.
struct MistakeKind {
  std::span<const MistakeAdvice> advice;
  void (*of_reading)(const SuspectRun& run, std::size_t i, Explanations& found) = nullptr;
  void (*of_run)(const SuspectRun& run, Explanations& found) = nullptr;
  /// @return the smallest p-value of the kind's hypotheses, to first order, without a further fit.
  double (*quick_p)(const SuspectRun& run, const HypothesisFit& fit) = nullptr;
  /// Fits the kind's hypotheses and passes each fit to `consider`.
  void (*detect)(const SuspectRun& run, const Consider& consider) = nullptr;
  /// @return the fit of a hypothesis that concerns all axes in all readings. The test uses the
  ///         scatter of each axis.
  HypothesisFit (*of_all_axes)(const SuspectRun& run) = nullptr;
};

[[nodiscard]] MistakeKind wrong_pose_kind();
[[nodiscard]] MistakeKind wrong_value_kind();
[[nodiscard]] MistakeKind wrong_level_kind();
[[nodiscard]] MistakeKind stuck_kind();
[[nodiscard]] MistakeKind tilted_seat_kind();
[[nodiscard]] MistakeKind exchanged_kind();
[[nodiscard]] MistakeKind table_moved_kind();
[[nodiscard]] MistakeKind drift_kind();
[[nodiscard]] MistakeKind saturated_kind();
[[nodiscard]] MistakeKind bias_step_kind();
[[nodiscard]] MistakeKind memory_kind();

/// @return all kinds, the built-in ones first.
[[nodiscard]] std::span<const MistakeKind> mistake_kinds();

/// Appends a kind that the calling program defines. Must not be called while another thread
/// calibrates.
void add_mistake_kind(const MistakeKind& kind);

/// Returns the p-value of the F test of q added parameters, which reduce the sum of squares `total`
/// by `drop`.
///
/// If a hypothesis adds no parameters (for example a changed pose), the F test does not apply, and
/// the result is 1.
/// @param dof   the degrees of freedom of `total`.
/// @param loss  number by which the degrees of freedom of both sums of squares are divided; see
///              dof_reduction_factor().
[[nodiscard]] double nested_f_p(double total, double dof, double drop, double q, double loss = 1.0);

/// Returns nested_f_p() for the residuals perpendicular to the field of each reading, or 0 if the
/// run has fewer than 3 axes. If the cube's orientation varies randomly between readings, these
/// residuals scatter more than the residuals along the field. A rotation of the table also changes
/// only the perpendicular residuals, so only they are used in the test for such a rotation.
[[nodiscard]] double nested_p_across_field(const SuspectRun& run, const HypothesisFit& with);

/// Tests a hypothesis whose effect repeats in all blocks against the scatter of the poses. If,
/// under the hypothesis, the means of the poses scatter clearly more than the readings about these
/// means, then the readings of a pose share an error, and only the means are independent.
/// @param fit  function that fits the hypothesis to a run.
/// @return nested_f_p() for the means of the poses; 0 if the readings of a pose share no error.
[[nodiscard]] double nested_p_of_poses(
    const SuspectRun& run, const std::function<HypothesisFit(const SuspectRun& means)>& fit);

/// @return a correction with this code and the run numbers of these readings.
[[nodiscard]] Correction about(const SuspectRun& run,
                               WarningCode code,
                               const std::vector<std::size_t>& readings);

/// @return the set that contains only reading i.
[[nodiscard]] ReadingSet one_reading(const ReadingSet& set, std::size_t i);

/// Returns the squared distance of a response from the prediction by the other readings, in units
/// of the axes' scales.
/// @param one      the set of only this reading (one_reading()), in the pose to try.
/// @param without  the fit without this reading.
[[nodiscard]] double distance_squared(const SuspectRun& run,
                                      const ReadingSet& one,
                                      const HypothesisFit& without,
                                      const Eigen::VectorXd& response);

/// Predicts a reading from the other readings: m entries [unit].
/// @param one      the set of only this reading (one_reading()).
/// @param without  the fit without this reading.
[[nodiscard]] Eigen::VectorXd predict_from_other_readings(const SuspectRun& run,
                                                          const ReadingSet& one,
                                                          const HypothesisFit& without);

}  // namespace axiscal
