// SPDX-License-Identifier: Apache-2.0
// The report's sections on the coefficients: as a matrix, and in other common forms.
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// A table with one row per axis: bias and sensitivities with their expanded uncertainties.
std::string coefficients_matrix(const Calibration& calibration);

/// Tables of all parameters with u, U and degrees of freedom, of the parameters independent of the
/// mounting, of the polar form, of the alignments and of the correlations.
std::string more_coefficients(const Calibration& calibration);

}  // namespace axiscal
