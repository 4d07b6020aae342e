// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The part of a calibration that does not depend on the mounting of the instrument: each axis's
/// bias b_k and sensitivity |S_k|, and the angles between axes.
struct IntrinsicParameters {
  std::vector<std::string> names;  ///< "x.bias", "x.sensitivity", "angle.x.y" [rad]
  Eigen::VectorXd values;
  std::vector<CombinedUncertainty> uncertainty;  ///< empty if the record has no covariance
  /// Covariance of `values` from all sources; empty if it is unknown.
  Eigen::MatrixXd covariance;
};

/// Computes the intrinsic parameters of a record.
/// @par Source
/// J. Geist, M. Y. Afridi, C. D. McGray, M. Gaitan, J. Res. NIST 122, 32 (2017).
[[nodiscard]] AXISCAL_EXPORT IntrinsicParameters
intrinsic_parameters(const Calibration& calibration);

/// E_n = (x1 - x2) / sqrt(U1^2 + U2^2). Two laboratories agree if |E_n| <= 1.
/// @param expanded_1, expanded_2  expanded uncertainties (95 %).
/// @return NaN if an uncertainty is NaN.
/// @par Source
/// ISO/IEC 17043, annex B.
[[nodiscard]] AXISCAL_EXPORT double e_n_score(double value_1,
                                              double expanded_1,
                                              double value_2,
                                              double expanded_2);

}  // namespace axiscal
