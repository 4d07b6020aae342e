// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/kernels/repeated_fit.hpp"

namespace axiscal {

/// Factors a design once, by the regression core's QR, for fit_repeatedly() and simulations.
///
/// @param design  X, n x p with n > p.
/// @param names   names of the parameters for error messages; empty: "parameter 1", ...
/// @throws DomainError, RankDeficientError  as LeastSquaresDesign.
[[nodiscard]] AXISCAL_EXPORT RepeatedDesign repeated_design(
    const Eigen::Ref<const Eigen::MatrixXd>& design, const std::vector<std::string>& names = {});

}  // namespace axiscal
