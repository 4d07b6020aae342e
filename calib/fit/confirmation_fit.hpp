// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Compares readings that were kept out of a fit with its predictions.
///
/// An error of prediction has the variance s_k^2 / w + J C J^T, J with the tangents of the field's
/// direction where that was fitted; each is held against its own interval, t(nu_k), and all
/// together against F(q, nu_k) for each axis, the axes put together by Fisher's method.
///
/// @param fitted       the readings of the fit.
/// @param kept_out     one or more others, as ReadingSource::kept_out().
/// @param field        as fitted or given.
/// @param known_field  whether it was given.
/// @throws RefusedError  where the readings of the fit do not determine a prediction.
/// @par Source
/// method.md, section 5.
[[nodiscard]] Confirmation confirmed(const ReadingSet& fitted,
                                     const ReadingSet& kept_out,
                                     const TableField& field,
                                     bool known_field);

}  // namespace axiscal
