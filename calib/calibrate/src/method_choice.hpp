// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibrate.hpp"

namespace axiscal {

/// @return true if each reading states the field that it met.
[[nodiscard]] bool has_stated_fields(const Observations& observations);

/// @return true if each reading states the point at which it was taken.
[[nodiscard]] bool has_labels(const Observations& observations);

/// Says in the record what the method takes for granted of the readings.
/// @param used  the readings that are not left out.
void note_choice_of_method(const Observations& used, Method method, Calibration& calibration);

}  // namespace axiscal
