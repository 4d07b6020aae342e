// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// Turns an instrument's frame to that of another instrument in the same recording: a
/// magnetometer's to its accelerometer's, so that headings can be tilt-compensated.
///
/// Method `magnitude` leaves the frame undetermined. The constant angle between the two fields
/// determines it, except for a common rotation. Both instruments must have been read at the same
/// times: row by row, without removing runs from one of the tables. Warnings are given if the
/// rotation is uncertain, or if the angle differs from the site's.
///
/// @param calibration   of the instrument, three axes; its sensitivity, covariance and quantities
///                      come out in the companion's frame, and `alignment` says how it was turned.
/// @param observations  its readings.
/// @param companion     the other's record, three axes.
/// @param companions    the other's readings, as many.
/// @param record        the companion's name, for the record.
/// @throws SetupError    unless it was calibrated by method magnitude without design points, S
///                       taken as symmetric.
/// @throws DomainError   if the readings are not as many, or either has not three axes.
/// @throws RefusedError  as align_by_constant_angle().
AXISCAL_EXPORT void align_with_companion(Calibration& calibration,
                                         const Observations& observations,
                                         const Calibration& companion,
                                         const Observations& companions,
                                         const std::string& record);

}  // namespace axiscal
