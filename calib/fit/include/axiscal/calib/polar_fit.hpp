// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/instruments/polar_form.hpp"

namespace axiscal {

/// Fits the polar form to the readings of one axis by damped Gauss-Newton, for comparison with the
/// method of Tripp and Tcheng. Linear regression gives the same result in one step, and it is not
/// singular at a coning angle of 0.
///
/// @param field_in_sensor  n x 3, the field at each reading [field unit]; n >= 4.
/// @param response         n readings of the axis [unit].
/// @param nominal_axis     0, 1 or 2: the nominal direction of the axis.
/// @throws DomainError  if sizes disagree, if there are fewer than 4 readings, or if nominal_axis
///                      is not 0, 1 or 2.
/// @par Source
/// Tripp and Tcheng, NASA/TP-1999-209835; method.md, section 3.1.
[[nodiscard]] AXISCAL_EXPORT PolarFit
fit_polar_form(const Eigen::Matrix<double, Eigen::Dynamic, 3>& field_in_sensor,
               const Eigen::VectorXd& response,
               int nominal_axis,
               AxisConvention convention);

}  // namespace axiscal
