// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"

namespace axiscal {

/// @return how far the field in the table may be from where it is expected [rad, 1 sd]: by a table
///         that is not level, a heading that nobody measured.
[[nodiscard]] double expected_direction_sd(const Experiment& experiment,
                                           const FieldDescription& field);

/// @param ratio  of a still reading's length to what it should be.
/// @return what the ratio of two units that are mistaken for one another explains; else empty.
[[nodiscard]] std::string unit_mistake_text(double ratio);

}  // namespace axiscal
