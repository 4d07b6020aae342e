// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

enum class SummaryDetail {
  brief,  ///< the main results, on a screen of 80 x 24 for three axes
  full,   ///< everything: sensing axes, levelness by block, quality of the fit
};

/// The end of a summary.
enum class SummaryEnd {
  findings,  ///< with the warnings and the verdict
  fit,       ///< without them: they are printed elsewhere
};

/// A report of a calibration as plain text, with tables of 80 columns: the procedure, coefficients
/// with their expanded uncertainties, levelness, quality, warnings and verdict.
[[nodiscard]] AXISCAL_EXPORT std::string summary(const Calibration& calibration,
                                                 SummaryDetail detail = SummaryDetail::brief,
                                                 SummaryEnd end = SummaryEnd::findings);

/// @return the verdict as a sentence: "Calibrated. No problems found."
[[nodiscard]] AXISCAL_EXPORT std::string words_of_verdict(const Calibration& calibration);

/// FieldSizeCheck in a sentence: "the reading of g agrees over 24 orientations to 12 ppm; ...";
/// empty where there is none.
[[nodiscard]] AXISCAL_EXPORT std::string words_of_field_size(const Calibration& calibration);

/// The result of the readings that were kept out of the fit, as a sentence; empty if there are
/// none.
[[nodiscard]] AXISCAL_EXPORT std::string words_of_confirmation(const Calibration& calibration);

}  // namespace axiscal
