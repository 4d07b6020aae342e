// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"

namespace axiscal {

/// @return the standard deviation of the field's direction in the table [rad]: for a table that is
///         not level, or a heading that was not measured.
[[nodiscard]] double expected_direction_sd(const Experiment& experiment,
                                           const FieldDescription& field);

/// @param ratio  of the length of a still reading to the expected length.
/// @return an explanation if the ratio is that of two confused units; otherwise empty.
[[nodiscard]] std::string unit_mistake_text(double ratio);

}  // namespace axiscal
