// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Method faces: bias and scale of readings on six faces of which nobody says that they lie level.
///
/// A face that leans by t moves a bias by t F if its direction is taken as known. The length of the
/// field does not: |S^-1 (v - b)| = F with a diagonal S holds whatever the lean, so that b and S
/// are off by t^2 / 2 only. Six faces determine no more than that; cross-axis terms are 0 in the
/// result, with a standard error of what the transverse components of the readings come to. With
/// fewer than three axes there is no length: bias and scale are half the sum and half the
/// difference of an axis's own two faces.
///
/// The scatter of a reading is that of the lengths if there are nine readings or more, else the
/// residual sd of the labelled fit, which holds the lean and is an upper bound.
///
/// @param F         the magnitude of the field [field unit].
/// @param estimate  by the labels, with the set's directions as given; takes over the result.
/// @return false, and nothing is changed, if the readings are not of all six faces, an axis does
/// not
///         lie along a pair of them, or further terms (temperature, second fields) were fitted.
[[nodiscard]] bool fit_face_lengths(const ReadingSet& set, double F, Estimate& estimate);

}  // namespace axiscal
