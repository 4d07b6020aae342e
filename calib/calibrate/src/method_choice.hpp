// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibrate.hpp"

namespace axiscal {

/// @return true if every reading has a stated field vector in the sensor's frame.
[[nodiscard]] bool has_stated_fields(const Observations& observations);

/// @return true if every reading has a design point.
[[nodiscard]] bool has_labels(const Observations& observations);

/// Adds a note to the record if fence faces are missing and the table is therefore taken as level.
/// @param used  the readings of the fit, without those that are left out.
void note_choice_of_method(const Observations& used, Method method, Calibration& calibration);

}  // namespace axiscal
