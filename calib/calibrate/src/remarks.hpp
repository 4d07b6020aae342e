// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Adds notes that do not require action: limits of an instrument with few axes, readings of weight
/// 0, a cube that rocks, an uncertain field.
void add_notes(Calibration& calibration,
               const Observations& observations,
               const Positioner& positioner);

/// Adds a note on inputs without a stated uncertainty. Adds notes on stated inputs that the
/// readings contradict: a resolution that is wider than the steps of the readings, or uncertainties
/// of cube and table that are far larger than the scatter of the field's magnitude.
/// @param resolution  the stated resolution [unit], or 0 if it is not stated.
void note_stated_inputs(double resolution, const ReadingSet& set, Calibration& calibration);

/// Adds notes on weights that were not stated, and on standard deviations of 0, which are replaced.
void note_weights(const Experiment& experiment,
                  const Observations& observations,
                  Calibration& calibration);

/// If the stated magnitude of the field is impossible on the Earth, adds a warning, and the
/// calibration is refused. Adds notes if the unit of the magnitude was inferred, or if neither
/// magnitude nor site is stated and the magnitude is therefore taken as 1.
void remark_on_magnitude(const Experiment& experiment, Calibration& calibration);

/// If the magnitude is the length of the stated vector, adds a note, because the vector may be
/// meant only as a direction. If the field is gravity in g and the length is not 1, adds a warning
/// instead.
void note_meaning_of_magnitude(const Experiment& experiment, Calibration& calibration);

/// Warns if a sensitivity is far from expected_sensitivity(). This detects a mistake that affects
/// the whole run, for example a wrong unit, and that the residuals do not show.
void warn_of_other_sensitivity(const Experiment& experiment, Calibration& calibration);

}  // namespace axiscal
