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
/// All readings enter. The field's direction is unknown unless the method knows it. Consecutive
/// readings at one design point belong to one laying. The call replaces coefficients, fields,
/// residual_sd, degrees of freedom, covariance, intervals and components of the estimate. They stay
/// as they are, with a note, if no error is shared or if the readings cannot separate it from
/// noise.
///
/// @param run  the readings that were fitted.
/// @return the share of each uncertain input in the covariance of the coefficients; empty if no
///         input was weighed.
/// @par Source
/// Searle, Casella & McCulloch, Variance Components (1992), secs. 6.6, 7.6, 11.1.
[[nodiscard]] std::vector<UncertaintySource> weigh_shared_errors(const Experiment& experiment,
                                                                 const SolvedReadings& run,
                                                                 Method method,
                                                                 Estimate& estimate);

/// The readings minus the most likely effect of the errors of uncertain inputs. Tests of single
/// readings use them, because these tests ignore shared errors.
///
/// @param set  the readings that were fitted.
/// @param of   the readings whose part is taken off: those, or others in their terms.
/// @return nullopt if no input is uncertain, or if the readings do not determine the errors.
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
/// @return nullopt if the readings do not determine the errors.
/// @par Source
/// method.md, section 5.
[[nodiscard]] std::optional<CurvatureTest> test_curvature(const Experiment& experiment,
                                                          const SolvedReadings& run,
                                                          Method method,
                                                          const Estimate& estimate);

}  // namespace axiscal
