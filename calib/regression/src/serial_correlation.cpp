// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/serial_correlation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/QR>

namespace axiscal {
namespace {

// An orthonormal basis of the columns.
Eigen::MatrixXd basis_of(const Eigen::MatrixXd& design) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(design);
  return qr.householderQ() * Eigen::MatrixXd::Identity(design.rows(), design.cols());
}

// The mean of each row's neighbours: A x, with 1/2 beside the diagonal.
Eigen::MatrixXd beside(const Eigen::MatrixXd& x) {
  const Eigen::Index n = x.rows();
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(n, x.cols());
  all.topRows(n - 1) += 0.5 * x.bottomRows(n - 1);
  all.bottomRows(n - 1) += 0.5 * x.topRows(n - 1);
  return all;
}

// V = rho^|i - j| + lambda I; or V = I + gamma within each block.
struct Model {
  double rho = 0.0;
  double lambda = 0.0;
  double gamma = 0.0;
  double prior = 1.0;
};

std::vector<Model> models(bool with_blocks) {
  constexpr std::array correlations = {0.0, 0.2, 0.4, 0.6, 0.75, 0.85, 0.92, 0.96, 0.985};
  constexpr std::array white = {0.0, 0.1, 0.3, 1.0, 3.0, 10.0};
  constexpr std::array shifts = {0.1, 0.3, 1.0, 3.0, 10.0, 30.0};
  std::vector<Model> all;
  for (const double rho : correlations) {
    for (const double lambda : white) {
      // Without correlation any lambda is the same model.
      if (rho > 0.0 || lambda == 0.0) {
        all.push_back({.rho = rho, .lambda = lambda, .prior = rho > 0.0 ? 1.0 / 6.0 : 1.0});
      }
    }
  }
  for (const double gamma : shifts) {
    if (with_blocks) {
      all.push_back({.gamma = gamma, .prior = 1.0 / 6.0});
    }
  }
  return all;
}

// L^-1 x of V = L L^T, and ln det V.
struct Whitened {
  Eigen::MatrixXd x;
  double log_determinant = 0.0;
};

// I + gamma 1 1^T has the root I + (sqrt(1 + gamma n) - 1) / n 1 1^T.
Whitened whiten_blocks(double gamma, const std::vector<int>& blocks, const Eigen::MatrixXd& x) {
  Whitened result{.x = x};
  for (Eigen::Index first = 0; first < x.rows();) {
    Eigen::Index after = first;
    while (after < x.rows() &&
           blocks[static_cast<std::size_t>(after)] == blocks[static_cast<std::size_t>(first)]) {
      ++after;
    }
    const auto n = static_cast<double>(after - first);
    const Eigen::RowVectorXd mean = x.middleRows(first, after - first).colwise().mean();
    result.x.middleRows(first, after - first).rowwise() -=
        (1.0 - 1.0 / std::sqrt(1.0 + gamma * n)) * mean;
    result.log_determinant += std::log1p(gamma * n);
    first = after;
  }
  return result;
}

Whitened whiten(const Model& model, const Eigen::VectorXd& places, const Eigen::MatrixXd& x) {
  Whitened result{.x = Eigen::MatrixXd(x.rows(), x.cols())};
  Eigen::RowVectorXd predicted = Eigen::RowVectorXd::Zero(x.cols());
  double variance = 1.0;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    if (i > 0) {
      const double kept = std::pow(model.rho, places(i) - places(i - 1));
      predicted *= kept;
      variance = kept * kept * variance + 1.0 - kept * kept;
    }
    const Eigen::RowVectorXd innovation = x.row(i) - predicted;
    const double whole = variance + model.lambda;
    result.x.row(i) = innovation / std::sqrt(whole);
    result.log_determinant += std::log(whole);
    predicted += variance / whole * innovation;
    variance *= model.lambda / whole;
  }
  return result;
}

// What one model says of all responses.
struct ModelFit {
  double log_likelihood = 0.0;
  Eigen::VectorXd estimate;
  Eigen::VectorXd variance;
};

ModelFit fit_model(const Model& model, const OrderedReadings& readings) {
  const Eigen::Index m = readings.responses.cols();
  ModelFit fit{.estimate = Eigen::VectorXd(m), .variance = Eigen::VectorXd(m)};
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::MatrixXd& X = readings.designs[static_cast<std::size_t>(k)];
    const Eigen::Index p = X.cols();
    Eigen::MatrixXd both(X.rows(), p + 1);
    both << X, readings.responses.col(k);
    const Whitened whitened = model.gamma > 0.0 ? whiten_blocks(model.gamma, readings.blocks, both)
                                                : whiten(model, readings.places, both);
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(whitened.x);
    const Eigen::MatrixXd R = qr.matrixQR().topRows(p + 1).triangularView<Eigen::Upper>();
    const auto free = static_cast<double>(X.rows() - p);
    const double least = std::numeric_limits<double>::min();
    const double squares = std::max(R(p, p) * R(p, p), least);
    const auto upper = R.topLeftCorner(p, p).triangularView<Eigen::Upper>();
    const Eigen::VectorXd estimate = upper.solve(R.topRightCorner(p, 1));
    // Row 0 of R^-1: its squares are the first entry of (R^T R)^-1.
    const Eigen::VectorXd row = upper.transpose().solve(Eigen::VectorXd::Unit(p, 0));
    fit.estimate(k) = estimate(0);
    fit.variance(k) = squares / free * row.squaredNorm();
    fit.log_likelihood += -0.5 * whitened.log_determinant -
                          R.diagonal().head(p).cwiseAbs().array().log().sum() -
                          0.5 * free * std::log(squares);
  }
  return fit;
}

}  // namespace

double lag_one_score(const OrderedReadings& readings) {
  const Eigen::Index n = readings.responses.rows();
  const Eigen::Index m = readings.responses.cols();
  double products = 0.0;
  double counted = 0.0;
  double mean = 0.0;
  double variance = 0.0;
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::MatrixXd Q = basis_of(readings.designs[static_cast<std::size_t>(k)]);
    const Eigen::VectorXd y = readings.responses.col(k);
    const Eigen::VectorXd e = y - Q * (Q.transpose() * y);
    const double squares = e.squaredNorm();
    const auto d = static_cast<double>(n - Q.cols());
    if (!(squares > 0.0) || !(d > 2.0)) {
      continue;
    }
    // Q' = P A P with P = I - Q Q^T: its trace and that of its square, without any n x n.
    const Eigen::MatrixXd AQ = beside(Q);
    const Eigen::MatrixXd G = Q.transpose() * AQ;
    const double trace = -G.trace();
    const double trace_of_square =
        0.5 * static_cast<double>(n - 1) - 2.0 * AQ.squaredNorm() + G.squaredNorm();
    products += d * e.head(n - 1).dot(e.tail(n - 1)) / squares;
    mean += trace;
    variance += 2.0 * (d * trace_of_square - trace * trace) / (d + 2.0);
    counted += 1.0;
  }
  // Each response's residuals are of the variance 1, so that their sums of squares are d.
  return counted > 0.0 ? (products - mean) / std::sqrt(variance) : 0.0;
}

CorrelatedMean mean_under_correlation(const OrderedReadings& readings) {
  const Eigen::Index m = readings.responses.cols();
  std::vector<ModelFit> fits;
  const std::vector<Model> all = models(!readings.blocks.empty());
  double best = -std::numeric_limits<double>::infinity();
  for (const Model& model : all) {
    fits.push_back(fit_model(model, readings));
    best = std::max(best, fits.back().log_likelihood);
  }
  double sum = 0.0;
  std::vector<double> weights;
  for (std::size_t g = 0; g < all.size(); ++g) {
    weights.push_back(all[g].prior * std::exp(fits[g].log_likelihood - best));
    sum += weights.back();
  }
  CorrelatedMean mean{.estimate = Eigen::VectorXd::Zero(m),
                      .u = Eigen::VectorXd::Zero(m),
                      .degrees_of_freedom = static_cast<double>(readings.responses.rows() -
                                                                readings.designs.front().cols())};
  for (std::size_t g = 0; g < all.size(); ++g) {
    weights[g] /= sum;
    mean.estimate += weights[g] * fits[g].estimate;
    mean.correlation += weights[g] * all[g].rho / (1.0 + all[g].lambda);
  }
  for (std::size_t g = 0; g < all.size(); ++g) {
    mean.u += weights[g] * (fits[g].variance + (fits[g].estimate - mean.estimate).cwiseAbs2());
  }
  mean.u = mean.u.cwiseSqrt();
  return mean;
}

}  // namespace axiscal
