// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Notes of a finished fit that do not require action: the limits of few axes, readings without
/// weight, a cube that rocks, an uncertain field.
void add_notes(Calibration& calibration,
               const Observations& observations,
               const Positioner& positioner);

/// Notes on inputs without a stated uncertainty, and on stated inputs that the readings contradict:
/// a resolution wider than the readings' steps, or uncertainties of cube and table that are far
/// larger than the scatter of the field's size.
/// @param resolution  the stated one [unit]; 0: none.
void note_stated_inputs(double resolution, const ReadingSet& set, Calibration& calibration);

/// Notes on weights that nobody stated, and on standard deviations of 0 that others stand for.
void note_weights(const Experiment& experiment,
                  const Observations& observations,
                  Calibration& calibration);

/// A magnitude that the field cannot have on the Earth refuses the record. Notes say that a number
/// without a unit was taken in the unit in which it is possible, and that a compass without a
/// stated field has one of length 1.
void remark_on_magnitude(const Experiment& experiment, Calibration& calibration);

/// A magnitude that nobody stated comes from the length of a vector that may be a direction only:
/// a note, or where the field is 1 g a warning.
void note_meaning_of_magnitude(const Experiment& experiment, Calibration& calibration);

/// A mistake in the whole run fits as well as no mistake; only what is expected shows it: the
/// nominal sensitivity, or what readings in a unit of the field's quantity should have.
void warn_of_other_sensitivity(const Experiment& experiment, Calibration& calibration);

}  // namespace axiscal
