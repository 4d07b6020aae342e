// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// Rotates the frame of an instrument to the frame of a second instrument in the same recording
/// (the companion). For example, a magnetometer is rotated to the frame of an accelerometer, for
/// tilt-compensated headings.
///
/// Method `magnitude` does not determine the rotation of the instrument's frame. However, the angle
/// between the fields that the two instruments measure is constant, and this determines the
/// rotation between the instruments. Row i of the readings of both instruments must have been
/// measured at the same time. Warnings are added if the rotation is uncertain, or if the
/// angle differs from the angle at the site.
///
/// @param calibration   record of the instrument, three axes. Its sensitivity, covariance and
///                      quantities are rotated to the companion's frame, and `alignment` is set.
/// @param observations  readings of the instrument.
/// @param companion     record of the companion, three axes.
/// @param companions    readings of the companion, with the same number of rows as `observations`.
/// @param record        name of the companion's record, for `alignment`.
/// @throws SetupError    if the instrument was not calibrated by method `magnitude`, if its
///                       readings have design points, or if its sensitivity matrix is not
///                       symmetric.
/// @throws DomainError   if the numbers of readings differ, or if an instrument does not have three
///                       axes.
/// @throws RefusedError  as align_by_constant_angle().
AXISCAL_EXPORT void align_with_companion(Calibration& calibration,
                                         const Observations& observations,
                                         const Calibration& companion,
                                         const Observations& companions,
                                         const std::string& record);

}  // namespace axiscal
