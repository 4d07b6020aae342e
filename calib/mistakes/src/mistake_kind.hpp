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

// Ranges of a mistake's parameters (method.md, section 5), in rad and parts of the full response.
inline constexpr double angle_range_rad = 0.08;
inline constexpr double value_range = 4.0;
inline constexpr double drift_range = 0.04;

// Readings are at the end of a range that lie beyond this part of the outermost.
inline constexpr double end_of_range = 0.9;

/// One explanation of a bad fit.
struct Explanation {
  double likelihood = 0.0;  // ln
  HypothesisFit fit;
  Correction correction;
  std::string words;  // behind "run 7: ", without how much better
};

/// The explanations of a run, in the order of the trials.
class Explanations {
 public:
  /// @param fit           under the explanation; one that is not fitted explains nothing.
  /// @param ranges        of the parameters that it adds.
  /// @param alternatives  how many of its kind there are.
  /// @param surely        added to its likelihood: ln of how much else speaks for it.
  void add(HypothesisFit fit,
           const std::vector<double>& ranges,
           double alternatives,
           Correction correction,
           std::string words,
           double surely = 0.0);

  /// @return all, the likeliest first.
  [[nodiscard]] std::vector<Explanation> ranked() &&;

 private:
  std::vector<Explanation> all_;
};

/// The remedy for a mistake, by the code of its warning.
struct MistakeAdvice {
  WarningCode code;
  std::string_view one;   // for one reading, or for the run
  std::string_view many;  // where several; empty: the same
};

/// A hypothesis that a run may be better described by.
struct CandidateHypothesis {
  double tests = 1.0;     ///< the number of similar hypotheses
  bool of_few = false;    ///< true if it concerns a few readings
  double at_least = 0.0;  ///< the probability that another test gives for chance
};
using Consider = std::function<void(const HypothesisFit& with, const CandidateHypothesis& how)>;

/// A kind of mistake: its detection, its explanation of a reading or of the run, and its remedy. A
/// kind without its own detection, such as a wrong pose, is detected by leaving readings out.
struct MistakeKind {
  std::span<const MistakeAdvice> advice;
  void (*of_reading)(const SuspectRun& run, std::size_t i, Explanations& found) = nullptr;
  void (*of_run)(const SuspectRun& run, Explanations& found) = nullptr;
  /// The smallest probability of its gain, to first order; no fit is made for it.
  double (*quick_p)(const SuspectRun& run, const HypothesisFit& fit) = nullptr;
  /// Its hypotheses, fitted, for the nested tests.
  void (*detect)(const SuspectRun& run, const Consider& consider) = nullptr;
  /// Its hypothesis where it changes all axes in all readings: each axis judges it by its own
  /// scatter.
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

/// @return all kinds.
[[nodiscard]] std::span<const MistakeKind> mistake_kinds();

/// Adds a kind of a program's own behind the others. Not while other threads calibrate.
void add_mistake_kind(const MistakeKind& kind);

/// The probability that q parameters take so much from a fit's sum of squares by chance.
///
/// A hypothesis that frees no parameter, such as another pose, is not nested: no F test judges it.
/// @param loss  of degrees of freedom, of both sums of squares (dof_reduction_factor()).
[[nodiscard]] double nested_f_p(double total, double dof, double drop, double q, double loss = 1.0);

/// As above, with the residuals perpendicular to the field of each reading. If the cube lies
/// differently each time, these residuals scatter more than those along the field, so a turn is
/// compared with them.
[[nodiscard]] double nested_p_across_field(const SuspectRun& run, const HypothesisFit& with);

/// @return a correction of that code about these readings.
[[nodiscard]] Correction about(const SuspectRun& run,
                               WarningCode code,
                               const std::vector<std::size_t>& readings);

/// A run of one reading alone.
[[nodiscard]] ReadingSet one_reading(const ReadingSet& set, std::size_t i);

/// The squared distance of a response from the other readings' prediction, in units of its axes'
/// scale.
/// @param one  the reading alone, as one_reading(), in the pose that is tried.
[[nodiscard]] double distance_squared(const SuspectRun& run,
                                      const ReadingSet& one,
                                      const HypothesisFit& without,
                                      const Eigen::VectorXd& response);

/// The prediction without a reading for this reading, m entries [unit].
/// @param one  that reading alone, see one_reading().
[[nodiscard]] Eigen::VectorXd predict_from_other_readings(const SuspectRun& run,
                                                          const ReadingSet& one,
                                                          const HypothesisFit& without);

}  // namespace axiscal
