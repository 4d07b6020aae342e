// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/serial_correlation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/QR>

namespace axiscal {
namespace {

// An orthonormal basis of the columns.
Eigen::MatrixXd basis_of(const Eigen::MatrixXd& design) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(design);
  return qr.householderQ() * Eigen::MatrixXd::Identity(design.rows(), design.cols());
}

// The mean of each row's neighbours: A x, with half of their weights beside the diagonal.
// @param weights  n - 1, of each pair of neighbours.
Eigen::MatrixXd beside(const Eigen::MatrixXd& x, const Eigen::VectorXd& weights) {
  const Eigen::Index n = x.rows();
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(n, x.cols());
  all.topRows(n - 1) += 0.5 * weights.asDiagonal() * x.bottomRows(n - 1);
  all.bottomRows(n - 1) += 0.5 * weights.asDiagonal() * x.topRows(n - 1);
  return all;
}

// V = signal rho^|i - j| h_i.h_j + white I; or V = I + gamma within each block.
struct Model {
  double rho = 0.0;
  double signal = 1.0;
  double white = 0.0;
  double gamma = 0.0;
  double prior = 1.0;
};

constexpr std::array correlations = {0.0, 0.2, 0.4, 0.6, 0.75, 0.85, 0.92, 0.96, 0.985, 0.995};
constexpr std::array white_parts = {0.0, 0.1, 0.3, 1.0, 3.0, 10.0};

// Correlated noise and white noise beside it.
// @param largest  of the correlations.
std::vector<Model> correlated_models(double largest) {
  std::vector<Model> all;
  for (const double rho : correlations) {
    for (const double white : white_parts) {
      // Without correlation any white noise is the same model, unless what it is seen along turns.
      if (rho <= largest && (rho > 0.0 || white == 0.0)) {
        all.push_back({.rho = rho,
                       .white = white,
                       .prior = rho > 0.0 ? 1.0 / static_cast<double>(white_parts.size()) : 1.0});
      }
    }
  }
  return all;
}

std::vector<Model> models_of_run(bool with_blocks) {
  constexpr std::array shifts = {0.1, 0.3, 1.0, 3.0, 10.0, 30.0};
  constexpr double largest = 0.985;  // a run has too few readings for more
  std::vector<Model> all = correlated_models(largest);
  for (const double gamma : shifts) {
    if (with_blocks) {
      all.push_back({.gamma = gamma, .prior = 1.0 / static_cast<double>(shifts.size())});
    }
  }
  return all;
}

// White noise, and a common cause that wanders more or less slowly beside it.
std::vector<Model> wandering_models() {
  constexpr std::array slow = {0.0, 0.5, 0.8, 0.92, 0.98};
  constexpr std::array sizes = {0.3, 1.0, 3.0, 10.0, 30.0};
  std::vector<Model> all = {{.signal = 0.0, .white = 1.0, .prior = 1.0}};
  for (const double rho : slow) {
    for (const double signal : sizes) {
      all.push_back({.rho = rho,
                     .signal = signal,
                     .white = 1.0,
                     .prior = 1.0 / static_cast<double>(sizes.size())});
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

// The Kalman filter of y_i = h_i . x_i + white noise, for all columns at once; d the components of
// the state.
template <int d>
Whitened whiten(const Model& model,
                const Eigen::VectorXd& places,
                const Eigen::MatrixXd& along,
                const Eigen::MatrixXd& x) {
  Whitened result{.x = Eigen::MatrixXd(x.rows(), x.cols())};
  Eigen::Matrix<double, d, Eigen::Dynamic> predicted =
      Eigen::Matrix<double, d, Eigen::Dynamic>::Zero(d, x.cols());
  using Square = Eigen::Matrix<double, d, d>;
  Square P = model.signal * Square::Identity();
  double kept_for = -1.0;
  double kept = 1.0;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    if (i > 0) {
      const double gap = places(i) - places(i - 1);
      if (gap != kept_for) {
        kept_for = gap;
        kept = std::pow(model.rho, gap);
      }
      predicted *= kept;
      P = (kept * kept * P + model.signal * (1.0 - kept * kept) * Square::Identity()).eval();
    }
    const Eigen::Matrix<double, d, 1> h = along.row(i).transpose();
    const Eigen::Matrix<double, d, 1> Ph = P * h;
    constexpr double least = 1e-12;
    const double whole = std::max(h.dot(Ph) + model.white, least);
    const Eigen::RowVectorXd innovation = x.row(i) - h.transpose() * predicted;
    result.x.row(i) = innovation / std::sqrt(whole);
    result.log_determinant += std::log(whole);
    predicted += Ph / whole * innovation;
    P -= Ph * Ph.transpose() / whole;
  }
  return result;
}

// What one model says of one response.
struct ModelFit {
  double log_likelihood = 0.0;
  Eigen::VectorXd estimate;
  Eigen::MatrixXd covariance;
};

// @param both  the design and the response beside it, whitened.
ModelFit fit_whitened(const Whitened& both) {
  const Eigen::Index p = both.x.cols() - 1;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(both.x);
  const Eigen::MatrixXd R = qr.matrixQR().topRows(p + 1).triangularView<Eigen::Upper>();
  const auto free = static_cast<double>(both.x.rows() - p);
  const double least = std::numeric_limits<double>::min();
  const double squares = std::max(R(p, p) * R(p, p), least);
  const auto upper = R.topLeftCorner(p, p).triangularView<Eigen::Upper>();
  const Eigen::MatrixXd inverse = upper.solve(Eigen::MatrixXd::Identity(p, p));
  return {.log_likelihood = -0.5 * both.log_determinant -
                            R.diagonal().head(p).cwiseAbs().array().log().sum() -
                            0.5 * free * std::log(squares),
          .estimate = upper.solve(R.topRightCorner(p, 1)),
          .covariance = squares / free * inverse * inverse.transpose()};
}

// The weights of models by their restricted likelihood and prior; they sum to 1.
std::vector<double> weights_of(const std::vector<Model>& models,
                               const std::vector<double>& log_likelihood) {
  const double best = *std::max_element(log_likelihood.begin(), log_likelihood.end());
  std::vector<double> weights;
  double sum = 0.0;
  for (std::size_t g = 0; g < models.size(); ++g) {
    weights.push_back(models[g].prior * std::exp(log_likelihood[g] - best));
    sum += weights.back();
  }
  for (double& weight : weights) {
    weight /= sum;
  }
  return weights;
}

// The mean over models of one response's coefficients; what parts the models counts as well.
CorrelatedFit average(const std::vector<double>& weights, const std::vector<ModelFit>& fits) {
  const Eigen::Index p = fits.front().estimate.size();
  CorrelatedFit mean{.estimate = Eigen::VectorXd::Zero(p),
                     .covariance = Eigen::MatrixXd::Zero(p, p)};
  for (std::size_t g = 0; g < weights.size(); ++g) {
    mean.estimate += weights[g] * fits[g].estimate;
  }
  for (std::size_t g = 0; g < weights.size(); ++g) {
    const Eigen::VectorXd off = fits[g].estimate - mean.estimate;
    mean.covariance += weights[g] * (fits[g].covariance + off * off.transpose());
  }
  return mean;
}

double correlation_of(const std::vector<Model>& models, const std::vector<double>& weights) {
  double sum = 0.0;
  for (std::size_t g = 0; g < models.size(); ++g) {
    sum += weights[g] * models[g].rho * models[g].signal / (models[g].signal + models[g].white);
  }
  return sum;
}

// The same of the only response, weighted by its own likelihoods.
CorrelatedFit mean_over(const std::vector<Model>& models,
                        const std::vector<ModelFit>& fits,
                        double degrees_of_freedom) {
  std::vector<double> log_likelihood;
  for (const ModelFit& fit : fits) {
    log_likelihood.push_back(fit.log_likelihood);
  }
  const std::vector<double> weights = weights_of(models, log_likelihood);
  CorrelatedFit mean = average(weights, fits);
  mean.degrees_of_freedom = degrees_of_freedom;
  mean.correlation = correlation_of(models, weights);
  return mean;
}

// How many standard deviations sum c_i z_i z_(i+1) is above what it would be for white noise.
// @param Q  n x p: the covariance of z is I - Q Q^T, in its variance.
// @param c  n - 1 weights of neighbours.
double likeness_score(const Eigen::VectorXd& z,
                      const Eigen::MatrixXd& Q,
                      const Eigen::VectorXd& weights) {
  const Eigen::Index n = z.size();
  const Eigen::MatrixXd AQ = beside(Q, weights);
  const Eigen::MatrixXd G = Q.transpose() * AQ;
  const Eigen::MatrixXd QQ = Q.transpose() * Q;
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
  const Eigen::Index n = readings.responses.rows();
  const Eigen::Index m = readings.responses.cols();
  double products = 0.0;
  double counted = 0.0;
  double mean = 0.0;
  double variance = 0.0;
  Eigen::MatrixXd Q;
  double trace = 0.0;
  double trace_of_square = 0.0;
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::MatrixXd& design = readings.designs[static_cast<std::size_t>(k)];
    if (k == 0 || design != readings.designs[static_cast<std::size_t>(k) - 1]) {
      Q = basis_of(design);
      // Q' = P A P with P = I - Q Q^T: its trace and that of its square, without any n x n.
      const Eigen::MatrixXd AQ = beside(Q, Eigen::VectorXd::Ones(n - 1));
      const Eigen::MatrixXd G = Q.transpose() * AQ;
      trace = -G.trace();
      trace_of_square = 0.5 * static_cast<double>(n - 1) - 2.0 * AQ.squaredNorm() + G.squaredNorm();
    }
    const Eigen::VectorXd y = readings.responses.col(k);
    const Eigen::VectorXd e = y - Q * (Q.transpose() * y);
    const double squares = e.squaredNorm();
    const auto d = static_cast<double>(n - Q.cols());
    if (!(squares > 0.0) || !(d > 2.0)) {
      continue;
    }
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
  const Eigen::Index n = readings.responses.rows();
  const std::vector<Model> models = models_of_run(!readings.blocks.empty());
  const Eigen::MatrixXd along = Eigen::MatrixXd::Ones(n, 1);
  std::vector<std::vector<ModelFit>> fits(static_cast<std::size_t>(m));
  std::vector<double> log_likelihood(models.size(), 0.0);
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::MatrixXd& X = readings.designs[static_cast<std::size_t>(k)];
    Eigen::MatrixXd both(n, X.cols() + 1);
    both << X, readings.responses.col(k);
    for (std::size_t g = 0; g < models.size(); ++g) {
      fits[static_cast<std::size_t>(k)].push_back(
          fit_whitened(models[g].gamma > 0.0 ? whiten_blocks(models[g].gamma, readings.blocks, both)
                                             : whiten<1>(models[g], readings.places, along, both)));
      log_likelihood[g] += fits[static_cast<std::size_t>(k)].back().log_likelihood;
    }
  }
  const std::vector<double> weights = weights_of(models, log_likelihood);
  CorrelatedMean mean{
      .estimate = Eigen::VectorXd(m),
      .u = Eigen::VectorXd(m),
      .degrees_of_freedom = static_cast<double>(n - readings.designs.front().cols()),
      .correlation = correlation_of(models, weights)};
  for (Eigen::Index k = 0; k < m; ++k) {
    const CorrelatedFit all = average(weights, fits[static_cast<std::size_t>(k)]);
    mean.estimate(k) = all.estimate(0);
    mean.u(k) = std::sqrt(all.covariance(0, 0));
  }
  return mean;
}

double lag_one_score(const Eigen::MatrixXd& design,
                     const Eigen::VectorXd& response,
                     const Eigen::MatrixX3d& along) {
  const Eigen::MatrixXd Q = basis_of(design);
  const Eigen::Index n = design.rows();
  return likeness_score(response - Q * (Q.transpose() * response), Q,
                        along.topRows(n - 1).cwiseProduct(along.bottomRows(n - 1)).rowwise().sum());
}

CorrelatedFit fit_under_correlation(const Eigen::MatrixXd& design,
                                    const Eigen::VectorXd& response,
                                    const Eigen::MatrixX3d& along) {
  const Eigen::Index n = design.rows();
  // Where there are more rows than tell the models apart, means of consecutive ones stand for them.
  constexpr Eigen::Index most = 1500;
  const Eigen::Index each = (n + most - 1) / most;
  const Eigen::Index rows = n / each;
  Eigen::MatrixXd both(rows, design.cols() + 1);
  Eigen::MatrixXd directions(rows, 3);
  for (Eigen::Index i = 0; i < rows; ++i) {
    both.row(i) << design.middleRows(each * i, each).colwise().mean(),
        response.segment(each * i, each).mean();
    directions.row(i) = along.middleRows(each * i, each).colwise().mean();
  }
  const Eigen::VectorXd places =
      Eigen::VectorXd::LinSpaced(rows, 0.0, static_cast<double>(rows - 1));
  const std::vector<Model> models = correlated_models(1.0);
  std::vector<ModelFit> fits;
  for (const Model& model : models) {
    fits.push_back(fit_whitened(whiten<3>(model, places, directions, both)));
  }
  return mean_over(models, fits, static_cast<double>(rows - design.cols()));
}

double likeness_along(const Eigen::VectorXd& z, const Eigen::MatrixXd& hat_root) {
  return likeness_score(z, hat_root, Eigen::VectorXd::Ones(z.size() - 1));
}

CorrelatedFit fit_under_wander(const WanderProblem& problem) {
  const Eigen::Index q = problem.information.rows();
  const Eigen::MatrixXd& A = problem.along;
  const Eigen::MatrixXd others = problem.information - A.transpose() * A;
  Eigen::MatrixXd both(A.rows(), q + 1);
  both << A, problem.deviations;
  const double squares_across = problem.squares - problem.deviations.squaredNorm();
  const std::vector<Model> models = wandering_models();
  std::vector<ModelFit> fits;
  for (const Model& model : models) {
    const Whitened whitened = whiten<1>(model, problem.places, problem.sizes, both);
    const auto W = whitened.x.leftCols(q);
    const auto y = whitened.x.col(q);
    const Eigen::MatrixXd N = others + W.transpose() * W;
    // Outside of the common cause the residuals are square to the columns already.
    const Eigen::VectorXd c = W.transpose() * y - A.transpose() * problem.deviations;
    const Eigen::LLT<Eigen::MatrixXd> cholesky(N);
    const Eigen::VectorXd step = cholesky.solve(c);
    const double least = std::numeric_limits<double>::min();
    const double squares = std::max(squares_across + y.squaredNorm() - c.dot(step), least);
    fits.push_back({.log_likelihood = -0.5 * whitened.log_determinant -
                                      cholesky.matrixLLT().diagonal().array().log().sum() -
                                      0.5 * problem.degrees_of_freedom * std::log(squares),
                    .estimate = step,
                    .covariance = squares / problem.degrees_of_freedom *
                                  cholesky.solve(Eigen::MatrixXd::Identity(q, q))});
  }
  return mean_over(models, fits, problem.degrees_of_freedom);
}

}  // namespace axiscal
