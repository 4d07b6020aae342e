// SPDX-License-Identifier: Apache-2.0
// Sections of a report: the coefficients as a matrix, and the coefficients in other common forms.
#pragma once

#include <string>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// @return a table with one row per axis: bias and sensitivities with their expanded uncertainties.
std::string coefficients_matrix(const Calibration& calibration);

/// @return the other tables: all parameters with u, U and degrees of freedom; the parameters that
///         do not depend on the mounting; the polar form; the alignments; the correlations.
std::string more_coefficients(const Calibration& calibration);

}  // namespace axiscal
