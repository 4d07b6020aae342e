// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/serial_correlation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "axiscal/core/parallel.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

// A row-major matrix, so that the numbers of one reading are contiguous.
using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A model of the noise covariance V. If gamma is 0, V_ij = signal rho^|i - j| h_i . h_j +
// white I_ij, where h_i is the direction of reading i. Otherwise V = I + gamma 1 1^T within each
// block.
struct Model {
  double rho = 0.0;
  double signal = 1.0;
  double white = 0.0;
  double gamma = 0.0;
  double prior = 1.0;
};

constexpr std::array correlations = {0.0, 0.2, 0.4, 0.6, 0.75, 0.85, 0.92, 0.96, 0.985, 0.995};
constexpr std::array white_parts = {0.0, 0.1, 0.3, 1.0, 3.0, 10.0};

// Returns models in which the noise is the sum of correlated noise and white noise.
// @param largest  largest correlation of the models.
std::vector<Model> correlated_models(double largest) {
  std::vector<Model> all;
  for (const double rho : correlations) {
    for (const double white : white_parts) {
      // If rho is 0 and the direction is constant, all values of `white` give the same model apart
      // from its scale. Therefore only one such model is used.
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
  constexpr double largest = 0.985;  // a run has too few readings for larger correlations
  std::vector<Model> all = correlated_models(largest);
  for (const double gamma : shifts) {
    if (with_blocks) {
      all.push_back({.gamma = gamma, .prior = 1.0 / static_cast<double>(shifts.size())});
    }
  }
  return all;
}

// Returns models in which the noise is the sum of white noise and the effect of a common cause, one
// model for each correlation and each size of the effect.
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

// The matrix x^T V^-1 x for an n x c matrix x, and ln det V. V is the covariance of the noise.
struct Whitened {
  Eigen::MatrixXd products;  // x^T V^-1 x, c x c; only the lower triangle is used
  double log_determinant = 0.0;
};

// Computes x^T V^-1 x and ln det V if V = I + gamma 1 1^T within each block. For a block of n
// readings, V^-1 = I - gamma / (1 + gamma n) 1 1^T.
Whitened whiten_blocks(double gamma, const std::vector<int>& blocks, const Rows& x) {
  Whitened result{.products = x.transpose() * x};
  for (Eigen::Index first = 0; first < x.rows();) {
    Eigen::Index after = first;
    while (after < x.rows() &&
           blocks[static_cast<std::size_t>(after)] == blocks[static_cast<std::size_t>(first)]) {
      ++after;
    }
    const auto n = static_cast<double>(after - first);
    const Eigen::VectorXd sum = x.middleRows(first, after - first).colwise().sum().transpose();
    result.products -= gamma / (1.0 + gamma * n) * sum * sum.transpose();
    result.log_determinant += std::log1p(gamma * n);
    first = after;
  }
  return result;
}

// Computes x^T V^-1 x and ln det V by a Kalman filter. Its model is y_i = h_i . s_i + white noise,
// where the state s_i has d components. The whitened rows are added in groups that fit in the
// cache.
template <int d>
Whitened whiten(const Model& model,
                const Eigen::VectorXd& places,
                const Eigen::MatrixXd& along,
                const Rows& x) {
  constexpr Eigen::Index most_rows = 256;
  const Eigen::Index n = x.rows();
  Rows white(std::min(n, most_rows), x.cols());
  Eigen::Index waiting = 0;  // number of rows of `white` that are not summed yet
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(x.cols(), x.cols());
  double log_determinant = 0.0;
  using State = Eigen::Matrix<double, d, Eigen::Dynamic>;
  State predicted = State::Zero(d, x.cols());
  using Square = Eigen::Matrix<double, d, d>;
  Square P = model.signal * Square::Identity();
  double kept_for = -1.0;
  double kept = 1.0;
  Eigen::RowVectorXd innovation(x.cols());
  for (Eigen::Index i = 0; i < n; ++i) {
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
    const Eigen::Matrix<double, d, 1> gain = Ph / whole;
    innovation = x.row(i);
    innovation -= h.transpose().lazyProduct(predicted);
    predicted += gain.lazyProduct(innovation);
    innovation /= std::sqrt(whole);
    log_determinant += std::log(whole);
    P -= gain * Ph.transpose();
    white.row(waiting++) = innovation;
    if (waiting == white.rows() || i + 1 == n) {
      products.template selfadjointView<Eigen::Lower>().rankUpdate(
          white.topRows(waiting).transpose());
      waiting = 0;
    }
  }
  return {.products = products, .log_determinant = log_determinant};
}

// The result of one model for one response.
struct ModelFit {
  double log_likelihood = 0.0;
  Eigen::VectorXd estimate;
  Eigen::MatrixXd covariance;
};

// The result of one noise model for the first coefficient of one response: its change from the
// plain fit, and its variance.
struct FirstCoefficient {
  double log_likelihood = 0.0;
  double change = 0.0;
  double variance = 0.0;
};

// The inverse Cholesky factor L^-1 of a matrix N = L L^T, and ln det N.
struct InverseRoot {
  Eigen::MatrixXd root;
  double log_determinant = 0.0;
};

// @param N  positive definite; only the lower triangle is used.
InverseRoot inverse_root_of(const Eigen::MatrixXd& N) {
  const Whitening whitening(N);
  return {.root = whitening.times(Eigen::MatrixXd::Identity(N.rows(), N.cols())),
          .log_determinant = 2.0 * whitening.root().diagonal().array().log().sum()};
}

// Fits the p columns of X to the residuals y, whose noise has the covariance V. The inputs are
// N = X^T V^-1 X, c = X^T V^-1 y and squares_of_y = y^T V^-1 y.
// @param N                only the lower triangle is used.
// @param log_determinant  ln det V.
ModelFit fit_by_sums(const Eigen::MatrixXd& N,
                     double log_determinant,
                     double degrees_of_freedom,
                     const Eigen::VectorXd& c,
                     double squares_of_y) {
  const InverseRoot inverse = inverse_root_of(N);
  ModelFit fit{.covariance = inverse.root.transpose() * inverse.root};
  fit.estimate = fit.covariance * c;
  const double squares =
      std::max(squares_of_y - c.dot(fit.estimate), std::numeric_limits<double>::min());
  fit.log_likelihood = -0.5 * (log_determinant + inverse.log_determinant) -
                       0.5 * degrees_of_freedom * std::log(squares);
  fit.covariance *= squares / degrees_of_freedom;
  return fit;
}

// The ordinary least-squares fits of r responses, computed in an orthonormal basis of the design's
// columns. A noise model changes the coefficients only slightly. This change is computed from the
// residuals, so that no digits are lost.
class PlainFit {
 public:
  // @param Y  r responses, n x r.
  PlainFit(const Eigen::MatrixXd& design, const Eigen::MatrixXd& Y)
      : p_(design.cols()), r_(Y.cols()), both_(design.rows(), p_ + r_) {
    const Eigen::MatrixXd Q = orthonormal_basis(design);
    root_ = inverse_of(Q.transpose() * design);
    in_basis_ = Q.transpose() * Y;
    both_ << Q, Y - Q * in_basis_;
  }

  // Returns the basis (p columns), followed by the residuals (r columns).
  [[nodiscard]] const Rows& basis_and_residuals() const { return both_; }

  // Computes the change of the coefficients that a noise model causes, and the covariance of the
  // coefficients. Both refer to the basis. There must be a single response (r = 1).
  [[nodiscard]] ModelFit under(const Whitened& sums) const {
    return fit_by_sums(sums.products.topLeftCorner(p_, p_), sums.log_determinant,
                       static_cast<double>(both_.rows() - p_),
                       sums.products.row(p_).head(p_).transpose(), sums.products(p_, p_));
  }

  // Computes the first coefficient of each response for a noise model.
  // @param first  receives r results.
  void first_under(const Whitened& sums, std::span<FirstCoefficient> first) const {
    // With N = L L^T, a^T N^-1 b is the scalar product of L^-1 a and L^-1 b.
    Eigen::MatrixXd forward(p_, 1 + r_);
    forward.col(0) = root_.row(0).transpose();
    forward.rightCols(r_) = sums.products.bottomLeftCorner(r_, p_).transpose();
    const InverseRoot inverse = inverse_root_of(sums.products.topLeftCorner(p_, p_));
    forward = inverse.root * forward;
    const double log_determinant = sums.log_determinant + inverse.log_determinant;
    const auto degrees_of_freedom = static_cast<double>(both_.rows() - p_);
    for (Eigen::Index j = 0; j < r_; ++j) {
      const auto of_response = forward.col(1 + j);
      const double squares = std::max(sums.products(p_ + j, p_ + j) - of_response.squaredNorm(),
                                      std::numeric_limits<double>::min());
      first[static_cast<std::size_t>(j)] = {
          .log_likelihood = -0.5 * log_determinant - 0.5 * degrees_of_freedom * std::log(squares),
          .change = forward.col(0).dot(of_response),
          .variance = squares / degrees_of_freedom * forward.col(0).squaredNorm()};
    }
  }

  // Transforms a mean over models from the basis to the design's columns, and adds the coefficients
  // of the plain fit. There must be a single response.
  [[nodiscard]] CorrelatedFit in_design(const CorrelatedFit& mean) const {
    CorrelatedFit result = mean;
    result.estimate = root_ * (in_basis_.col(0) + mean.estimate);
    result.covariance = root_ * mean.covariance * root_.transpose();
    return result;
  }

 private:
  Eigen::Index p_;
  Eigen::Index r_;
  Eigen::MatrixXd root_;      // p x p: the design times root_ is the basis
  Eigen::MatrixXd in_basis_;  // p x r: the coefficients of the plain fit in the basis
  Rows both_;
};

// Returns the weights of models, proportional to restricted likelihood times prior. They sum to 1.
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

double correlation_of(const std::vector<Model>& models, const std::vector<double>& weights) {
  double sum = 0.0;
  for (std::size_t g = 0; g < models.size(); ++g) {
    sum += weights[g] * models[g].rho * models[g].signal / (models[g].signal + models[g].white);
  }
  return sum;
}

// Computes the weighted mean over models of the coefficients of one response. The covariance
// includes the scatter between the models.
CorrelatedFit mean_over(const std::vector<Model>& models,
                        const std::vector<ModelFit>& fits,
                        double degrees_of_freedom) {
  std::vector<double> log_likelihood;
  for (const ModelFit& fit : fits) {
    log_likelihood.push_back(fit.log_likelihood);
  }
  const std::vector<double> weights = weights_of(models, log_likelihood);
  const Eigen::Index p = fits.front().estimate.size();
  CorrelatedFit mean{.estimate = Eigen::VectorXd::Zero(p),
                     .covariance = Eigen::MatrixXd::Zero(p, p),
                     .degrees_of_freedom = degrees_of_freedom,
                     .correlation = correlation_of(models, weights)};
  for (std::size_t g = 0; g < weights.size(); ++g) {
    mean.estimate += weights[g] * fits[g].estimate;
  }
  for (std::size_t g = 0; g < weights.size(); ++g) {
    const Eigen::VectorXd off = fits[g].estimate - mean.estimate;
    mean.covariance += weights[g] * (fits[g].covariance + off * off.transpose());
  }
  return mean;
}

}  // namespace

CorrelatedMean uncertainty_of_correlated_mean(const OrderedReadings& readings) {
  const Eigen::Index m = readings.responses.cols();
  const Eigen::Index n = readings.responses.rows();
  const std::vector<Model> models = models_of_run(!readings.blocks.empty());
  const Eigen::MatrixXd along = Eigen::MatrixXd::Ones(n, 1);
  CorrelatedMean mean{
      .u = Eigen::VectorXd(m),
      .u_if_white = Eigen::VectorXd(m),
      .degrees_of_freedom = static_cast<double>(n - readings.designs.front().cols())};
  std::vector<std::vector<FirstCoefficient>> of_models(
      models.size(), std::vector<FirstCoefficient>(static_cast<std::size_t>(m)));
  for (Eigen::Index first = 0; first < m;) {
    const Eigen::MatrixXd& design = readings.design_of(first);
    Eigen::Index end = first + 1;
    while (end < m && (&readings.design_of(end) == &design || readings.design_of(end) == design)) {
      ++end;
    }
    const PlainFit plain(design, readings.responses.middleCols(first, end - first));
    const Rows& both = plain.basis_and_residuals();
    for (std::size_t g = 0; g < models.size(); ++g) {
      const Whitened sums = models[g].gamma > 0.0
                                ? whiten_blocks(models[g].gamma, readings.blocks, both)
                                : whiten<1>(models[g], readings.places, along, both);
      plain.first_under(sums, std::span(of_models[g])
                                  .subspan(static_cast<std::size_t>(first),
                                           static_cast<std::size_t>(end - first)));
    }
    first = end;
  }
  std::vector<double> log_likelihood;
  for (const std::vector<FirstCoefficient>& all : of_models) {
    log_likelihood.push_back(std::accumulate(
        all.begin(), all.end(), 0.0,
        [](double sum, const FirstCoefficient& one) { return sum + one.log_likelihood; }));
  }
  const std::vector<double> weights = weights_of(models, log_likelihood);
  mean.correlation = correlation_of(models, weights);
  for (std::size_t k = 0; k < static_cast<std::size_t>(m); ++k) {
    double variance = 0.0;
    for (std::size_t g = 0; g < models.size(); ++g) {
      const FirstCoefficient& one = of_models[g][k];
      variance += weights[g] * (one.variance + one.change * one.change);
    }
    mean.u(static_cast<Eigen::Index>(k)) = std::sqrt(variance);
    // The first model is white noise.
    mean.u_if_white(static_cast<Eigen::Index>(k)) = std::sqrt(of_models.front()[k].variance);
  }
  return mean;
}

CorrelatedFit fit_with_correlated_noise(const Eigen::MatrixXd& design,
                                        const Eigen::VectorXd& response,
                                        const Eigen::MatrixX3d& along) {
  const Eigen::Index n = design.rows();
  // If there are more rows than this, consecutive rows are replaced by their mean.
  constexpr Eigen::Index most = 1500;
  const Eigen::Index each = (n + most - 1) / most;
  const Eigen::Index rows = n / each;
  Eigen::MatrixXd X(rows, design.cols());
  Eigen::VectorXd y(rows);
  Eigen::MatrixXd directions(rows, 3);
  for (Eigen::Index i = 0; i < rows; ++i) {
    X.row(i) = design.middleRows(each * i, each).colwise().mean();
    y(i) = response.segment(each * i, each).mean();
    directions.row(i) = along.middleRows(each * i, each).colwise().mean();
  }
  const PlainFit plain(X, y);
  const Eigen::VectorXd places =
      Eigen::VectorXd::LinSpaced(rows, 0.0, static_cast<double>(rows - 1));
  const std::vector<Model> models = correlated_models(1.0);
  std::vector<ModelFit> fits;
  for (const Model& model : models) {
    fits.push_back(plain.under(whiten<3>(model, places, directions, plain.basis_and_residuals())));
  }
  return plain.in_design(mean_over(models, fits, static_cast<double>(rows - design.cols())));
}

CorrelatedFit fit_with_common_ar1(const CommonAr1Problem& problem) {
  const Eigen::Index q = problem.information.rows();
  const Eigen::MatrixXd& A = problem.along;
  const Eigen::MatrixXd others = problem.information - A.transpose() * A;
  Rows both(A.rows(), q + 1);
  both << A, problem.deviations;
  // The residuals e of the linear fit satisfy J^T e = 0. J^T e is the sum of two parts: one along
  // the direction of the cause and one perpendicular to it. The perpendicular part is therefore the
  // negative of the other part.
  const Eigen::VectorXd gradient_across = -A.transpose() * problem.deviations;
  const double squares_across = problem.squares - problem.deviations.squaredNorm();
  const std::vector<Model> models = wandering_models();
  std::vector<ModelFit> fits(models.size());
  constexpr Eigen::Index worth_threads = 10000;
  for_each_in_parallel(
      models.size(),
      [&](std::size_t g) {
        const Whitened sums = whiten<1>(models[g], problem.places, problem.sizes, both);
        fits[g] = fit_by_sums(others + sums.products.topLeftCorner(q, q), sums.log_determinant,
                              problem.degrees_of_freedom,
                              gradient_across + sums.products.row(q).head(q).transpose(),
                              squares_across + sums.products(q, q));
      },
      both.rows() < worth_threads ? 1 : 0);
  return mean_over(models, fits, problem.degrees_of_freedom);
}

}  // namespace axiscal
