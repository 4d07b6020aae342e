// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/experiment.hpp"
#include "calib/fit/estimation.hpp"

namespace axiscal {

/// Repeats the tests of lack of fit if readings share errors of uncertain inputs, because repeats
/// do not show these errors. The means of the poses scatter about the model with the covariance V =
/// s^2 / n + H C H^T. Here s is the standard deviation of the repeats with nu_e degrees of freedom,
/// n is the number of readings in a pose, C is the covariance of the inputs, and H is the
/// derivative of the means with respect to the inputs.
///
/// The statistic is T = y^T P y / nu_l. Here y are the means whitened by V, and P projects onto the
/// nu_l directions orthogonal to the design. T is compared with F(nu_l, nu_e / a^2), where a is the
/// mean share of s^2 / n in V.
///
/// If the field's direction is fitted, each axis fits it separately here.
///
/// @param set       the readings that were fitted.
/// @param estimate  statistics.lack_of_fit is replaced if inputs are uncertain.
/// @par Source
/// method.md, section 5.
void test_lack_of_fit_of_inputs(const Experiment& experiment,
                                const ReadingSet& set,
                                Method method,
                                Estimate& estimate);

}  // namespace axiscal
