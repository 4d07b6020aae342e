// SPDX-License-Identifier: Apache-2.0
// What was found: the coefficients as a matrix, and the other ways in which people state them.
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// One row an axis: bias and sensitivities with their expanded uncertainties.
std::string coefficients_matrix(const Calibration& calibration);

/// All parameters with u, U and degrees of freedom; independent of the mounting; polar; alignments;
/// correlations.
std::string more_coefficients(const Calibration& calibration);

}  // namespace axiscal
