// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/experiment.hpp"
#include "calib/fit/estimation.hpp"

namespace axiscal {

/// Repeats the tests of lack of fit if readings share errors of uncertain inputs, which repeats do
/// not show. The means of poses scatter about the model with the covariance V = s^2 / n + H C H^T,
/// where s is the standard deviation of the repeats. T = y^T P y / nu_l is compared with F(nu_l,
/// nu_e / a^2). Here a is the mean share of s^2 in V.
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
