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

/// Adds notes on inputs without a stated uncertainty, and on stated inputs that the readings
/// contradict: a resolution wider than the readings' steps, or uncertainties of cube and table that
/// are far larger than the scatter of the field's magnitude.
/// @param resolution  the stated resolution [unit]; 0: not stated.
void note_stated_inputs(double resolution, const ReadingSet& set, Calibration& calibration);

/// Adds notes on weights that were not stated, and on standard deviations of 0, which are replaced.
void note_weights(const Experiment& experiment,
                  const Observations& observations,
                  Calibration& calibration);

/// Adds a warning that refuses the record if the field cannot have its magnitude on the Earth. Adds
/// notes if the unit of the magnitude was inferred, or if the field is not stated and has length 1.
void remark_on_magnitude(const Experiment& experiment, Calibration& calibration);

/// If the magnitude was taken from the length of a stated vector, adds a note, because the vector
/// may be only a direction. For gravity in g with a length other than 1, it adds a warning.
void note_meaning_of_magnitude(const Experiment& experiment, Calibration& calibration);

/// Warns if a sensitivity is far from expected_sensitivity(). This finds a mistake in the whole
/// run, for example a wrong unit, which the residuals do not show.
void warn_of_other_sensitivity(const Experiment& experiment, Calibration& calibration);

}  // namespace axiscal
