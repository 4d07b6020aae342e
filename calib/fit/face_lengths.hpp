// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Method `faces`: computes bias and scale from readings on six faces, which need not be level.
///
/// If the field's direction is taken as known, a face that leans by an angle t shifts the bias by t
/// F. The magnitude of the field does not depend on the lean. Therefore the bias b and the diagonal
/// matrix S of the scales are fitted so that the measured magnitudes |S^-1 (v - b)| are F. The lean
/// then causes relative errors of only t^2 / 2. Six faces determine only bias and scale. Cross-axis
/// terms are 0 in the result; their standard error is the size of the transverse components of the
/// readings.
///
/// With fewer than three axes the magnitude is not measured. Bias and scale are then (v1 + v2) / 2
/// and (v1 - v2) / (2 F) with the readings v1 and v2 on the axis's positive and negative face.
///
/// With three axes and at least nine readings in total, the scatter of a reading is computed from
/// the measured magnitudes. Otherwise it is the residual standard deviation of the fit that takes
/// the stated faces as exact. This value includes the lean and is therefore an upper bound.
///
/// @param F         the magnitude of the field [field unit].
/// @param estimate  the fit that takes the stated faces and the given direction of the field as
///                  exact; receives the result.
/// @return false if the readings do not cover all six faces, if an axis does not lie along a pair
///         of faces, or if further terms (temperature, second fields) were fitted; `estimate` is
///         then not changed.
[[nodiscard]] bool fit_face_lengths(const ReadingSet& set, double F, Estimate& estimate);

}  // namespace axiscal
