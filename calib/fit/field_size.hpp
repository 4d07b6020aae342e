// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

/// Tests whether the magnitude of the field varies too much between orientations. The magnitude is
/// measured in each orientation by the calibrated instrument. Its variation is compared with the
/// variation that the scatter of the readings and the stated uncertainties of cube and table
/// predict.
///
/// An error of the orientation does not change the magnitude of the field. A measured magnitude
/// |S^-1 (v - b)| therefore has only two errors: noise, and errors of b and S that the orientation
/// errors cause. For errors e of the readings, the residuals are r = P e with P = 1 - J (J^T J)^-1
/// J^T, where J is the Jacobian of the fit. To first order, the errors of the magnitudes are A P e.
/// A has a row u^T S^-1 for each reading, with the unit vector u of its field. The test compares
/// the sum of squares of these errors with its expectation tr(A P V P^T A^T). V is the covariance
/// of the noise and of the errors that readings share through the inputs.
///
/// @param run          the readings that were fitted.
/// @param field        the fitted or given field.
/// @param calibration  the calibration; its response and statistics must be set.
/// @return nullopt if there are not three axes that used all readings, if the field is a sum of
///         parts, if readings lack design points, or if there are more than 240 readings.
/// @par Source
/// Geist & Gaitan, Metrologia 59 (2022) 052101, for the idea; method.md, section 5.
[[nodiscard]] std::optional<FieldSizeCheck> check_field_size(const Experiment& experiment,
                                                             const SolvedReadings& run,
                                                             Method method,
                                                             const TableField& field,
                                                             const Calibration& calibration);

}  // namespace axiscal
