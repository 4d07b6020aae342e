// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/experiment.hpp"
#include "calib/fit/estimation.hpp"

namespace axiscal {

/// The tests of lack of fit anew where readings share errors of uncertain inputs, which repeats do
/// not show: means of poses about the model with the covariance V = s^2 / n + H C H^T, s of the
/// repeats, T = y^T P y / nu_l held against F(nu_l, nu_e / a^2), a the mean share of s^2 in V.
///
/// Each axis has the field's direction for itself here, where it is fitted.
///
/// @param set       the readings that were fitted.
/// @param estimate  its statistics' lack_of_fit is replaced where inputs are uncertain.
/// @par Source
/// method.md, section 5.
void test_lack_of_fit_of_inputs(const Experiment& experiment,
                                const ReadingSet& set,
                                Method method,
                                Estimate& estimate);

}  // namespace axiscal
