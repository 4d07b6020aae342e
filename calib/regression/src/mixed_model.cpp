// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/mixed_model.hpp"

#include "axiscal/calib/scaled_qr.hpp"

namespace axiscal {

std::optional<MixedModelFit> fit_mixed_model(const Eigen::MatrixXd& W,
                                             const Eigen::VectorXd& y,
                                             Eigen::Index random) {
  const Eigen::Index n = W.rows();
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n + random, W.cols());
  A.topRows(n) = W;
  A.bottomRightCorner(random, random).setIdentity();
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n + random);
  b.head(n) = y;
  constexpr double smallest_pivot = 1e-9;
  const ScaledQr qr(A, smallest_pivot);
  if (!qr.has_full_rank()) {
    return std::nullopt;
  }
  MixedModelFit fit{.estimate = qr.solve(b), .covariance = qr.covariance(), .residuals = y};
  fit.residuals -= W * fit.estimate;
  return fit;
}

}  // namespace axiscal
