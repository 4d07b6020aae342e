// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

/// Fits again where readings share errors: those of inputs that are not exactly known, and the turn
/// of the cube each time it is laid, whose size the readings tell as it moves the field across
/// itself alone. Generalised least squares, V = diag(sigma_k^2 / w) + tau^2 K K^T + H C H^T,
/// sigma_k and tau by restricted likelihood (method.md, section 4).
///
/// All readings enter, with the field's direction unknown unless the method knows it. Consecutive
/// readings at one design point are of one laying. Coefficients, fields, residual_sd, degrees of
/// freedom, covariance, intervals and components of the estimate are replaced; they stay where
/// nothing is shared, or the readings do not tell it from noise, which the notes then say.
///
/// @param run  the readings that were fitted.
/// @return what each uncertain input leaves in the coefficients; none where nothing was weighed.
/// @par Source
/// Searle, Casella & McCulloch, Variance Components (1992), secs. 6.6, 7.6, 11.1.
[[nodiscard]] std::vector<UncertaintySource> weigh_shared_errors(const Experiment& experiment,
                                                                 const SolvedReadings& run,
                                                                 Method method,
                                                                 Estimate& estimate);

/// The readings without what the errors of uncertain inputs, which they share, most likely add to
/// them; for tests of single readings, which know nothing of shared errors.
///
/// @param set  the readings that were fitted.
/// @param of   the readings whose part is taken off: those, or others in their terms.
/// @return nothing where no input is uncertain, or the readings do not tell.
/// @par Source
/// method.md, section 5; Robinson, Statistical Science 6 (1991) 15-32 (best linear unbiased
/// prediction).
[[nodiscard]] std::optional<ReadingSet> without_shared_errors(const Experiment& experiment,
                                                              const ReadingSet& set,
                                                              Method method,
                                                              const Estimate& estimate,
                                                              const ReadingSet& of);

/// Columns f_k^2, the field along each axis, added to the fit with all its shared errors: an F test
/// of nested models.
///
/// @param run       the readings that were fitted.
/// @param estimate  as weigh_shared_errors() leaves it.
/// @return nothing where the readings do not tell.
/// @par Source
/// method.md, section 5.
[[nodiscard]] std::optional<CurvatureTest> test_curvature(const Experiment& experiment,
                                                          const SolvedReadings& run,
                                                          Method method,
                                                          const Estimate& estimate);

}  // namespace axiscal
