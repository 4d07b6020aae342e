// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

/// Holds the size of the field, as the calibrated instrument reads it in each orientation, against
/// what the readings' scatter and the stated uncertainties of cube and table make of it.
///
/// An orientation that is not what it was taken for does not change the field's length: what S^-1
/// (v - b) is too long or too short comes of noise and of what wrong orientations did to b and S.
/// Of residuals r = P e, P = 1 - J (J^T J)^-1 J^T, the lengths are off by m = A P e to first order,
/// A of u^T S^-1: their sum of squares is held against its expectation tr(A P V P^T A^T), V of the
/// noise and of the inputs' shared errors.
///
/// @param run          the readings that were fitted.
/// @param field        as fitted or given.
/// @param calibration  with response and statistics.
/// @return nothing for other than three axes that used all readings, a sum of fields, readings
///         without design points, or more than 240 of them.
/// @par Source
/// Geist & Gaitan, Metrologia 59 (2022) 052101, for the idea; method.md, section 5.
[[nodiscard]] std::optional<FieldSizeCheck> check_field_size(const Experiment& experiment,
                                                             const SolvedReadings& run,
                                                             Method method,
                                                             const TableField& field,
                                                             const Calibration& calibration);

}  // namespace axiscal
