// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"

namespace axiscal {

/// @return the prior standard deviation of the field's direction in the table [rad]. It allows for
///         a table that is not level, for iron nearby and for an unknown heading.
[[nodiscard]] double expected_direction_sd(const Experiment& experiment,
                                           const FieldDescription& field);

/// @param ratio  magnitude of a reading at rest divided by the expected magnitude.
/// @return a message if the ratio is typical of two confused units; otherwise empty.
[[nodiscard]] std::string unit_mistake_text(double ratio);

}  // namespace axiscal
