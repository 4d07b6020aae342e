// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/solved_readings.hpp"

namespace axiscal {

/// Repeats the fit if several readings share errors. Such errors come from uncertain inputs, and
/// from the random rotation of the cube each time it is put down. The size of this rotation can be
/// estimated from the readings. It changes the field only perpendicular to the direction of the
/// field, whereas noise acts in all directions.
///
/// The method is generalised least squares. The readings have the covariance V = diag(sigma_k^2 /
/// w) + tau^2 K K^T + H C H^T. Here w is the weight of a reading, K and H are the derivatives of
/// the readings with respect to the rotations and to the inputs, and C is the covariance of the
/// inputs. The noise sigma_k of each axis and the standard deviation tau of the rotations are
/// estimated by restricted likelihood (method.md, section 4).
///
/// All readings are used. The field's direction is fitted unless the method takes it as known.
/// Consecutive readings at one design point belong to one placement of the cube. The call replaces
/// coefficients, fields, residual_sd, degrees of freedom, covariance, intervals and components of
/// the estimate. If no errors are shared, or if the readings cannot separate shared errors from
/// noise, the call changes only the notes of the estimate.
///
/// @param run  the readings that were fitted.
/// @return the contribution of each uncertain input to the covariance of the coefficients; empty if
///         the fit included no uncertain input.
/// @par Source
/// Searle, Casella & McCulloch, Variance Components (1992), secs. 6.6, 7.6, 11.1.
[[nodiscard]] std::vector<UncertaintySource> weigh_shared_errors(const Experiment& experiment,
                                                                 const SolvedReadings& run,
                                                                 Method method,
                                                                 Estimate& estimate);

/// Returns the readings minus the most likely effect of the errors of uncertain inputs. Tests of
/// single readings use the result, because these tests ignore shared errors.
///
/// @param set  the readings that were fitted.
/// @param of   the readings from which the effect is subtracted: `set`, or other readings with the
///             same axes and model.
/// @return nullopt if no input is uncertain, or if the readings do not determine the errors.
/// @par Source
/// method.md, section 5; Robinson, Statistical Science 6 (1991) 15-32 (best linear unbiased
/// prediction).
[[nodiscard]] std::optional<ReadingSet> without_shared_errors(const Experiment& experiment,
                                                              const ReadingSet& set,
                                                              Method method,
                                                              const Estimate& estimate,
                                                              const ReadingSet& of);

/// Tests for curvature of the axes' responses by an F test of nested models. The first fit has no
/// squared terms. The second fit has a column f_k^2 for each axis k, where f_k is the component of
/// the field along the axis. Both fits include the shared errors.
///
/// @param run       the readings that were fitted.
/// @param estimate  the estimate after weigh_shared_errors().
/// @return nullopt if the readings do not determine the fit, or if their rounding errors could look
///         like curvature.
/// @par Source
/// method.md, section 5.
[[nodiscard]] std::optional<CurvatureTest> test_curvature(const Experiment& experiment,
                                                          const SolvedReadings& run,
                                                          Method method,
                                                          const Estimate& estimate);

}  // namespace axiscal
