// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// Notes of a finished fit that do not require action: the limits of few axes, readings without
/// weight, a cube that rocks, an uncertain field.
void add_notes(Calibration& calibration,
               const Observations& observations,
               const Positioner& positioner);

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
void say_what_length_means(const Experiment& experiment, Calibration& calibration);

/// A mistake in the whole run fits as well as no mistake; only what is expected shows it: the
/// nominal sensitivity, or what readings in a unit of the field's quantity should have.
void warn_of_other_sensitivity(const Experiment& experiment, Calibration& calibration);

}  // namespace axiscal
