// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/mistakes/src/suspect_run.hpp"

namespace axiscal {

// The limits below are those of the quick tests.

// Number of classes of tests that share one level of significance.
inline constexpr double classes = 8.0;
inline constexpr double worth_a_look = 0.04;  // p-value below which mistakes are searched for
// Limit of the scatter, as a fraction of the full response. Above it, a run is suspicious.
inline constexpr double large_share = 0.003;
// The axes' noise is taken as equal if the test for equal scatter has a p-value above this.
inline constexpr double may_be_equal = 0.5;

/// Returns true if the run needs a full search: if its scatter is a large fraction of the full
/// response, if a quick test finds a mistake, or if a reading contradicts the others. The quick
/// tests use the scales of the axes in `run`. If the scatters of the axes differ, the test that
/// leaves out one reading is repeated with each axis weighted by its scatter.
[[nodiscard]] bool is_suspicious(const SuspectRun& run);

/// Tests whether the readings contradict each other, by nested F tests for all kinds of mistakes.
/// @return true if they do.
/// @param run  the run, after fit_single_deletions(). This function calls fit_pair_deletions(). If
///             the noise of the axes clearly differs, it also calls weigh_axes_by().
[[nodiscard]] bool is_bad(SuspectRun& run);

/// @return the scatter of the fit of all readings, divided by the scatter under a hypothesis.
[[nodiscard]] double scatter_reduction_factor(const SuspectRun& run, const HypothesisFit& fit);

/// Returns true if the scatter of the fit of all readings is more than 1.15 times the scatter under
/// a hypothesis. If SuspectRun::has_independent_readings() is true, a smaller but statistically
/// significant reduction of the scatter also counts.
[[nodiscard]] bool is_clearly_better(const SuspectRun& run, const HypothesisFit& with);

}  // namespace axiscal
