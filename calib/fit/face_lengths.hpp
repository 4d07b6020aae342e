// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Method faces: bias and scale of readings on six faces of which nobody says that they lie level.
///
/// A face that leans by t moves a bias by t F if its direction is taken as known. The length of the
/// field does not change: |S^-1 (v - b)| = F with a diagonal S holds for any lean, so b and S are
/// off by t^2 / 2 only. Six faces determine only this much. Cross-axis terms are 0 in the result;
/// their standard error is the size of the transverse components of the readings. With fewer than
/// three axes the length is unknown; then bias and scale are half the sum and half the difference
/// of the axis's two faces.
///
/// The scatter of a reading is that of the lengths if there are nine readings or more, else the
/// residual sd of the labelled fit, which holds the lean and is an upper bound.
///
/// @param F         the magnitude of the field [field unit].
/// @param estimate  by the labels, with the set's directions as given; takes over the result.
/// @return false, and no change, if the readings do not cover all six faces, if an axis does not
///         lie along a pair of faces, or if further terms (temperature, second fields) were fitted.
[[nodiscard]] bool fit_face_lengths(const ReadingSet& set, double F, Estimate& estimate);

}  // namespace axiscal
