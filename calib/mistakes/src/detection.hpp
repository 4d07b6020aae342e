// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/mistakes/src/suspect_run.hpp"

namespace axiscal {

// Levels of the quick tests.
inline constexpr double classes = 8.0;        // over which levels are shared
inline constexpr double worth_a_look = 0.04;  // probability in the quick tests, before any refit
inline constexpr double large_share = 0.003;  // of scatter, in the full response
// Above this probability of the axes' scatters nothing says that their noise differs.
inline constexpr double may_be_equal = 0.5;

/// True if a closer search is worthwhile: for all axes together, and for each in units of its
/// scatter.
[[nodiscard]] bool is_suspicious(const SuspectRun& run);

/// Tests whether the readings contradict each other, by nested F tests of the possible mistakes,
/// for all classes together.
/// @param run  whose readings were left out one by one; on return two by two as well, and with axes
///             that count as they scatter where their noise clearly differs.
[[nodiscard]] bool is_bad(SuspectRun& run);

/// By how much smaller a hypothesis makes the scatter.
[[nodiscard]] double scatter_reduction_factor(const SuspectRun& run, const HypothesisFit& fit);

/// True if a hypothesis explains the residuals of the plain fit: it reduces the scatter by a clear
/// part, or by more than chance does if readings are many.
[[nodiscard]] bool is_clearly_better(const SuspectRun& run, const HypothesisFit& with);

}  // namespace axiscal
