// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

/// Compares the field's length, measured by the calibrated instrument in each orientation, with the
/// length expected from the readings' scatter and from the stated uncertainties of cube and table.
///
/// A wrong orientation does not change the field's length. A length S^-1 (v - b) is wrong for two
/// reasons: noise, and the effect of wrong orientations on b and S. For errors e of the readings,
/// the residuals are r = P e with P = 1 - J (J^T J)^-1 J^T. To first order the lengths have the
/// errors m = A P e. A has a row u^T S^-1 for each reading, with the unit vector u of its field.
/// The test compares the sum of squares of the lengths' errors with its expectation tr(A P V P^T
/// A^T). V is the covariance of the noise and of the inputs' shared errors.
///
/// @param run          the readings that were fitted.
/// @param field        the fitted or given field.
/// @param calibration  the calibration; its response and statistics must be set.
/// @return nullopt if there are not three axes that used all readings, if the field is a sum, if
///         readings lack design points, or if there are more than 240 readings.
/// @par Source
/// Geist & Gaitan, Metrologia 59 (2022) 052101, for the idea; method.md, section 5.
[[nodiscard]] std::optional<FieldSizeCheck> check_field_size(const Experiment& experiment,
                                                             const SolvedReadings& run,
                                                             Method method,
                                                             const TableField& field,
                                                             const Calibration& calibration);

}  // namespace axiscal
