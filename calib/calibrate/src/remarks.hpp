// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// Notes of a finished fit that ask for nothing: what few axes cannot say, readings without weight,
/// a cube that rocks, an uncertain field.
void add_notes(Calibration& calibration,
               const Observations& observations,
               const Positioner& positioner);

/// A magnitude that nobody stated comes from the length of a vector that may be a direction only:
/// a note, or where the field is 1 g a warning.
void say_what_length_means(const Experiment& experiment, Calibration& calibration);

/// A mistake in the whole run fits as well as no mistake; only what is expected shows it: the
/// nominal sensitivity, or what readings in a unit of the field's quantity should have.
void warn_of_other_sensitivity(const Experiment& experiment, Calibration& calibration);

}  // namespace axiscal
