// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/experiment.hpp"
#include "calib/fit/estimation.hpp"

namespace axiscal {

/// Repeats the tests of lack of fit if uncertain inputs cause errors that several readings share.
/// The scatter of repeated readings at a pose does not show such errors. The mean readings of the
/// poses scatter about the model with the covariance V = s^2 / n + H C H^T. Here s is the standard
/// deviation of repeated readings with nu_e degrees of freedom, n is the number of readings at a
/// pose, C is the covariance of the inputs, and H is the derivative of the means with respect to
/// the inputs.
///
/// The statistic is T = y^T P y / nu_l. Here y is the vector of the means, whitened by V, and P
/// projects onto the nu_l directions orthogonal to the design. T is compared with F(nu_l, nu_e /
/// a^2), where a is the mean share of s^2 / n in V.
///
/// If the field's direction is fitted, this test fits it separately for each axis.
///
/// @param set       the readings that were fitted.
/// @param estimate  the estimate. If inputs are uncertain, statistics.lack_of_fit is replaced.
/// @par Source
/// method.md, section 5.
void test_lack_of_fit_of_inputs(const Experiment& experiment,
                                const ReadingSet& set,
                                Method method,
                                Estimate& estimate);

}  // namespace axiscal
