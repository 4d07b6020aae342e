// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/kernels/repeated_fit.hpp"

namespace axiscal {

/// Computes the QR factorisation of a design matrix once, so that fit_repeatedly() and simulations
/// can use it many times.
///
/// @param design  X, n x p with n > p.
/// @param names   names of the parameters for error messages; empty: "parameter 1", ...
/// @throws DomainError, RankDeficientError  as LeastSquaresDesign.
[[nodiscard]] AXISCAL_EXPORT RepeatedDesign repeated_design(
    const Eigen::Ref<const Eigen::MatrixXd>& design, const std::vector<std::string>& names = {});

}  // namespace axiscal
