// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/correction.hpp"
#include "calib/fit/estimation.hpp"

namespace axiscal {

/// The result of the search for a mistake.
struct Culprit {
  std::vector<CalibrationWarning> warnings;  // the likeliest first
  Correction correction;                     // the remedy of the likeliest mistake
  double effect =
      0.0;  // the effect of the mistake on the coefficients, in parts of the full response
};

/// The report of a search for mistakes in a run.
struct MistakeSearch {
  std::optional<Culprit> culprit;  // nothing for a good run
  std::string remark;              // of a reading that may be wrong, or of noise with heavy tails
};

/// @return the remedy for a mistake, as a sentence.
[[nodiscard]] std::string_view advice_of(const Correction& correction);

/// True if a run can be searched: enough labelled readings of one field, all used.
[[nodiscard]] bool can_be_searched(const ReadingSet& set, const Estimate& estimate);

/// Looks whether the readings of a run contradict each other, and if so which mistake explains it
/// (method.md, section 5, culprit search).
///
/// Detected by nested F tests on the fit of all readings, 0.005 in all: one or two readings
/// deleted, the table moved, drift, an axis's extremes shifted. Then every explanation is fitted
/// and ranked by its likelihood, with a penalty for freedom and for the alternatives of its kind.
///
/// @param known_field  whether the field's direction is given.
/// @param without_shared_errors  the set without the shared errors of its readings, because these
///                               are not mistakes. The run must look bad in this form too. Null:
///                               shared errors are absent.
[[nodiscard]] MistakeSearch find_culprit(const ReadingSet& set,
                                         const Estimate& estimate,
                                         bool known_field,
                                         const ReadingSet* without_shared_errors = nullptr);

}  // namespace axiscal
