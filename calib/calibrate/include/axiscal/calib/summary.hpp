// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// A calibration for people: what was done, coefficients with their expanded uncertainties,
/// levelness, quality; plain text of 80 columns, as the command prints it.
[[nodiscard]] std::string summary(const Calibration& calibration);

/// FieldSizeCheck in a sentence: "the reading of g agrees over 24 orientations to 12 ppm; ...";
/// empty where there is none.
[[nodiscard]] std::string words_of_field_size(const Calibration& calibration);

/// What the readings say that were kept out of the fit, in a sentence; empty where there are none.
[[nodiscard]] std::string words_of_confirmation(const Calibration& calibration);

}  // namespace axiscal
