// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/fit/cause.hpp"
#include "calib/fit/layings.hpp"

namespace axiscal {

/// A part of a run's noise: the weighted sum of squares r' D r of the residuals r, and its expected
/// value and variance for white noise. D is a diagonal matrix of weights. P is the projection onto
/// the residual space.
struct PartOfNoise {
  double squares = 0.0;          // r' D r
  double trace = 0.0;            // trace of P D P: expected value of r' D r for noise of variance 1
  double trace_of_square = 0.0;  // trace of (P D P)^2: half the variance of r' D r

  [[nodiscard]] double freedom() const { return trace * trace / trace_of_square; }
};

/// The p-values below which add_field_noise() widens intervals. They are larger for few readings,
/// because the tests then detect less.
struct Gate {
  explicit Gate(Eigen::Index readings) : has_few(readings < few) {}

  static constexpr Eigen::Index few = 24;
  bool has_few;
  double above = has_few ? 0.10 : 0.05;
  double below = has_few ? 0.15 : 0.05;
  double above_of_axis = has_few ? 0.10 : 0.03;
};

/// The 95 % quantile of the standard normal distribution. add_field_wander() fits models of
/// correlated noise if the score of its correlation test is larger.
inline constexpr double one_sided_5_percent = 1.645;

/// The least number of readings for the tests in add_field_noise() and add_field_wander().
inline constexpr Eigen::Index fewest_looked_at = 8;

/// Calls `use` with the readings in their order. If consecutive readings of a pose share an error
/// (CountedEstimate::means_counted), it gets the means of the layings.
/// @param use  function of a SolvedReadings.
template <typename Use>
void with_layings(const ScatterAnalysisInput& run, const CountedEstimate& so_far, const Use& use) {
  if (!so_far.means_counted) {
    use(run.judged);
    return;
  }
  const MeanReadings layings = average_layings(run.judged.set(), so_far.estimate);
  if (layings.own) {
    use(SolvedReadings(*layings.own, run.judged.known_field()));
  } else {
    use(run.judged);  // each laying has one reading, and `judged` may already be solved
  }
}

/// Calls `use` with the readings whose errors are independent. These are the means of the poses if
/// all readings of a pose share an error (CountedEstimate::poses_counted), otherwise the readings
/// of with_layings().
/// @param use  function of a SolvedReadings.
template <typename Use>
void with_independent_readings(const ScatterAnalysisInput& run,
                               const CountedEstimate& so_far,
                               const Use& use) {
  if (!so_far.poses_counted) {
    with_layings(run, so_far, use);
    return;
  }
  const MeanReadings poses = average_poses(run.judged.set(), so_far.estimate);
  use(SolvedReadings(poses.set(), run.judged.known_field()));
}

}  // namespace axiscal
