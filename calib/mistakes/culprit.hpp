// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/correction.hpp"
#include "calib/fit/estimation.hpp"

namespace axiscal {

/// What the search for a mistake found.
struct Culprit {
  std::vector<CalibrationWarning> warnings;  // the likeliest first
  Correction correction;                     // what mends the likeliest
  double effect = 0.0;  // what the mistake does to the coefficients, in parts of the full response
};

/// What a search for mistakes says of a run.
struct MistakeSearch {
  std::optional<Culprit> culprit;  // nothing for a good run
  std::string remark;              // of a reading that may be wrong, or of noise with heavy tails
};

/// Whether a run can be searched: labelled readings of one field, all used, enough of them.
[[nodiscard]] bool can_be_searched(const ReadingSet& set, const Estimate& estimate);

/// Looks whether the readings of a run contradict each other, and if so which mistake explains it
/// (method.md, section 5, culprit search).
///
/// Detected by nested F tests on the fit of all readings, 0.005 in all: one or two readings
/// deleted, the table moved, drift, an axis's extremes shifted. Then every explanation is fitted
/// and ranked by its likelihood, with a penalty for freedom and for the alternatives of its kind.
///
/// @param known_field  whether the field's direction is given.
/// @param without_shared_errors  the set as it is without errors that its readings share, which are
///                     no mistakes: the run must look bad like this too. Null: there are none.
[[nodiscard]] MistakeSearch find_culprit(const ReadingSet& set,
                                         const Estimate& estimate,
                                         bool known_field,
                                         const ReadingSet* without_shared_errors = nullptr);

}  // namespace axiscal
