// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

enum class SummaryDetail {
  brief,  ///< what most people come for, on a screen of 80 x 24 for three axes
  full,   ///< sensing axes, levelness by block, quality of the fit, all of it
};

/// The end of a summary.
enum class SummaryEnd {
  findings,  ///< with the warnings and the verdict
  fit,       ///< without them: they are printed elsewhere
};

/// A calibration for people: what was done, coefficients with their expanded uncertainties,
/// levelness, quality, warnings and verdict; plain text, its tables of 80 columns.
[[nodiscard]] std::string summary(const Calibration& calibration,
                                  SummaryDetail detail = SummaryDetail::brief,
                                  SummaryEnd end = SummaryEnd::findings);

/// @return whether it holds, in a sentence: "Calibrated. Nothing in the readings speaks against
/// it."
[[nodiscard]] std::string words_of_verdict(const Calibration& calibration);

/// FieldSizeCheck in a sentence: "the reading of g agrees over 24 orientations to 12 ppm; ...";
/// empty where there is none.
[[nodiscard]] std::string words_of_field_size(const Calibration& calibration);

/// What the readings say that were kept out of the fit, in a sentence; empty where there are none.
[[nodiscard]] std::string words_of_confirmation(const Calibration& calibration);

}  // namespace axiscal
