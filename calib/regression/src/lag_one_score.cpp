// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "calib/regression/factor.hpp"
#include "calib/regression/serial_correlation.hpp"

namespace axiscal {
namespace {

// Returns A x. Row i of A x is half the weighted sum of the rows i - 1 and i + 1 of x.
// @param weights  n - 1 weights: one for each pair of consecutive rows.
Eigen::MatrixXd beside(const Eigen::MatrixXd& x, const Eigen::VectorXd& weights) {
  const Eigen::Index n = x.rows();
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(n, x.cols());
  all.topRows(n - 1) += 0.5 * weights.asDiagonal() * x.bottomRows(n - 1);
  all.bottomRows(n - 1) += 0.5 * weights.asDiagonal() * x.topRows(n - 1);
  return all;
}

// Computes a score of the correlation between consecutive values: the sum of c_i z_i z_(i+1),
// standardised by its mean and its standard deviation for white noise.
// @param Q        n x p: the covariance of z is (I - Q Q^T) times the noise variance.
// @param QQ       Q^T Q.
// @param weights  the weights c_i, n - 1 entries: one for each pair of consecutive values.
double likeness_score(const Eigen::VectorXd& z,
                      const Eigen::MatrixXd& Q,
                      const Eigen::MatrixXd& QQ,
                      const Eigen::VectorXd& weights) {
  const Eigen::Index n = z.size();
  const Eigen::MatrixXd AQ = beside(Q, weights);
  const Eigen::MatrixXd G = Q.transpose() * AQ;
  const double d = static_cast<double>(n) - QQ.trace();
  const double trace = -G.trace();
  const double c = trace / d;
  const double variance =
      2.0 * (0.5 * weights.squaredNorm() - 2.0 * AQ.squaredNorm() + G.squaredNorm() -
             2.0 * c * (-2.0 * G.trace() + QQ.cwiseProduct(G).sum()) +
             c * c * (static_cast<double>(n) - 2.0 * QQ.trace() + QQ.squaredNorm()));
  const double squares = z.squaredNorm();
  if (!(squares > 0.0) || !(d > 2.0) || !(variance > 0.0)) {
    return 0.0;
  }
  const double products = d * z.head(n - 1).cwiseProduct(weights).dot(z.tail(n - 1)) / squares;
  return (products - trace) / std::sqrt(variance);
}

}  // namespace

double lag_one_score(const OrderedReadings& readings) {
  const Eigen::Index m = readings.responses.cols();
  LagOneScore score;
  for (Eigen::Index first = 0; first < m;) {
    const Eigen::MatrixXd& design = readings.design_of(first);
    Eigen::Index end = first + 1;
    while (end < m && (&readings.design_of(end) == &design || readings.design_of(end) == design)) {
      ++end;
    }
    const Eigen::MatrixXd Q = orthonormal_basis(design);
    const auto y = readings.responses.middleCols(first, end - first);
    score.add(Q, Eigen::MatrixXd(y - Q * (Q.transpose() * y)));
    first = end;
  }
  return score.value();
}

double lag_one_score(const Eigen::MatrixXd& design,
                     const Eigen::VectorXd& response,
                     const Eigen::MatrixX3d& along) {
  const Eigen::MatrixXd Q = orthonormal_basis(design);
  const Eigen::Index n = design.rows();
  return likeness_score(response - Q * (Q.transpose() * response), Q, Q.transpose() * Q,
                        along.topRows(n - 1).cwiseProduct(along.bottomRows(n - 1)).rowwise().sum());
}

double lag_one_score_along(const Eigen::VectorXd& z,
                           const Eigen::MatrixXd& hat_root,
                           const Eigen::MatrixXd& hat_squares) {
  return likeness_score(z, hat_root, hat_squares, Eigen::VectorXd::Ones(z.size() - 1));
}

}  // namespace axiscal
