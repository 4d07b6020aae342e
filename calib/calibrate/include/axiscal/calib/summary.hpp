// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

enum class SummaryDetail {
  brief,  ///< the main results; for three axes, they fit into 80 columns and 24 lines
  full,   ///< all results, with the sensing axes, levelness by block, and quality of the fit
};

/// The last part of a summary.
enum class SummaryEnd {
  findings,  ///< the summary ends with the warnings and the verdict
  fit,       ///< the summary ends before the warnings and the verdict
};

/// Returns a report of a calibration as plain text, with tables of at most 80 columns. It contains
/// the procedure, the coefficients with their expanded uncertainties, levelness, quality, warnings
/// and verdict.
[[nodiscard]] AXISCAL_EXPORT std::string summary(const Calibration& calibration,
                                                 SummaryDetail detail = SummaryDetail::brief,
                                                 SummaryEnd end = SummaryEnd::findings);

/// @return the verdict as a sentence: "Calibrated. No problems found."
[[nodiscard]] AXISCAL_EXPORT std::string verdict_sentence(const Calibration& calibration);

/// @return the FieldSizeCheck as a sentence: "The measured value of g scatters over 24 orientations
///         by 12 ppm; ..."; empty if the record lacks this check.
[[nodiscard]] AXISCAL_EXPORT std::string field_size_sentence(const Calibration& calibration);

/// @return the result of the confirmation as a sentence; empty if the record lacks a confirmation.
[[nodiscard]] AXISCAL_EXPORT std::string confirmation_sentence(const Calibration& calibration);

}  // namespace axiscal
