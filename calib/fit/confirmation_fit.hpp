// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// The comparison, and notes on blocks.
struct ConfirmedReadings {
  Confirmation confirmation;
  std::vector<CalibrationNote> notes;
};

/// Compares readings that were kept out of a fit with its predictions.
///
/// An error of prediction has the variance s_k^2 / w + J C J^T. J contains the tangents of the
/// field's direction if it was fitted. Each error is compared with its own interval, t(nu_k), and
/// all together with F(q, nu_k) for each axis, the axes combined by Fisher's method. The noise
/// across the field may be larger or smaller than along it: the p-value is the largest over the
/// ratios that the readings of the fit do not reject. Of a block that the fit does not know, the
/// shift that its readings share is not compared.
///
/// @param fitted       the readings of the fit.
/// @param kept_out     one or more others, as ReadingSource::kept_out().
/// @param field        as fitted or given.
/// @param known_field  whether it was given.
/// @throws RefusedError  where the readings of the fit do not determine a prediction.
/// @par Source
/// method.md, section 5.
[[nodiscard]] ConfirmedReadings confirmed(const ReadingSet& fitted,
                                          const ReadingSet& kept_out,
                                          const TableField& field,
                                          bool known_field);

}  // namespace axiscal
