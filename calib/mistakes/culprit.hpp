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

/// The mistakes that explain a contradiction between the readings.
struct Culprit {
  std::vector<CalibrationWarning> warnings;  // sorted, the most likely mistake first
  Correction correction;                     // corrects the most likely mistake
  // The largest change of a coefficient that the mistake causes. It is stated as the resulting
  // change of an axis's output in the reference field, divided by the axis's response to the field.
  double effect = 0.0;
};

/// The result of a search for mistakes in a run.
struct MistakeSearch {
  std::optional<Culprit> culprit;  // nullopt if no mistake was found
  // Remark on a reading that may be wrong; empty if there is no such reading.
  std::string remark;
};

/// @return the advice for the mistake, one or more sentences; empty if there is no advice for the
///         code of the mistake.
[[nodiscard]] std::string_view advice_of(const Correction& correction);

/// Returns true if a run can be searched for mistakes. The run must have at least 6 readings of a
/// single field. The orientation of each reading must be stated, and no reading may be excluded.
[[nodiscard]] bool can_be_searched(const ReadingSet& set, const Estimate& estimate);

/// Tests whether the readings of a run contradict each other. If they do, finds the mistakes that
/// explain the contradiction best (docs/method/mistakes.md).
///
/// Nested F tests on the fit of all readings detect that there is a mistake. Then every possible
/// explanation is fitted, and the explanations are ranked by likelihood, with a penalty for each
/// added parameter and for the number of alternatives of the same kind.
///
/// @param known_field  true if the field's direction is given.
/// @param without_shared_errors  the same readings, minus the estimated effect of errors that many
///                               readings share (for example an error of the cube). Such errors are
///                               not mistakes, so the tests must detect a mistake in this set too.
///                               Null if the readings have no shared errors.
[[nodiscard]] MistakeSearch find_culprit(const ReadingSet& set,
                                         const Estimate& estimate,
                                         bool known_field,
                                         const ReadingSet* without_shared_errors = nullptr);

}  // namespace axiscal
