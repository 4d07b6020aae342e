// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/QR>
#include <Eigen/SVD>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/regression/src/double_double.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

// Pivots below this fraction of the largest pivot count as zero. The most difficult design that
// must be accepted is Filip's polynomial (a test problem of NIST), whose smallest pivot is 1e-10 of
// the largest.
constexpr double rank_tolerance = 1e-13;

// Returns the power of two that is nearest to 1 / length. Scaling by a power of two loses no
// digits.
double scale_of(double length) {
  if (!(length > 0.0)) {
    return 1.0;
  }
  int exponent = 0;
  const double part = std::frexp(length, &exponent);  // 0.5 <= part < 1
  return std::ldexp(1.0, part < 0.5 * std::numbers::sqrt2 ? 1 - exponent : -exponent);
}

Eigen::VectorXd column_scales(const Eigen::Ref<const Eigen::MatrixXd>& A) {
  Eigen::VectorXd scale(A.cols());
  for (Eigen::Index j = 0; j < A.cols(); ++j) {
    // Sums of squares between this limit and its reciprocal neither overflow nor lose digits.
    constexpr double far_from_limits = 1e-200;
    const double squares = A.col(j).squaredNorm();
    const double length = squares > far_from_limits && squares < 1.0 / far_from_limits
                              ? std::sqrt(squares)
                              : A.col(j).stableNorm();
    scale(j) = scale_of(length);
  }
  return scale;
}

// Returns an upper bound of the condition number for columns of length 1. It is the product of the
// Frobenius norms of A and of its pseudo-inverse. The bound is at most p times the condition
// number, which is close enough for most designs.
double bound_of_condition(const Eigen::MatrixXd& A, const Eigen::MatrixXd& root) {
  const double squares = A.colwise().squaredNorm() * root.rowwise().squaredNorm();
  return std::sqrt(static_cast<double>(A.cols()) * squares);
}

std::vector<Eigen::Index> open_columns(const Eigen::ColPivHouseholderQR<Eigen::MatrixXd>& qr) {
  const Eigen::Index columns = qr.cols();
  const Eigen::MatrixXd& R = qr.matrixQR();
  const Eigen::Index pivots = std::min(qr.rows(), columns);
  Eigen::Index rank = 0;
  while (rank < pivots &&
         std::abs(R(rank, rank)) > rank_tolerance * std::max(std::abs(R(0, 0)), 1e-300)) {
    ++rank;
  }
  std::vector<Eigen::Index> open;
  if (rank == columns) {
    return open;
  }
  // A basis of the null space of [R11 R12]: the columns (-R11^-1 R12, 1), in pivoted order.
  Eigen::MatrixXd null_space(columns, columns - rank);
  null_space.bottomRows(columns - rank).setIdentity();
  null_space.topRows(rank) = -R.topLeftCorner(rank, rank)
                                  .triangularView<Eigen::Upper>()
                                  .solve(R.topRightCorner(rank, columns - rank));
  const Eigen::MatrixXd in_order = qr.colsPermutation() * null_space;
  for (Eigen::Index j = 0; j < columns; ++j) {
    if (in_order.row(j).norm() > 1e-8) {
      open.push_back(j);
    }
  }
  return open;
}

std::string name_of(Eigen::Index j, const std::vector<std::string>& names) {
  const auto i = static_cast<std::size_t>(j);
  return i < names.size() ? names[i] : formatted("parameter {}", j + 1);
}

}  // namespace

std::vector<Eigen::Index> undetermined_columns(const Eigen::Ref<const Eigen::MatrixXd>& design) {
  const Eigen::VectorXd scale = column_scales(design);
  return open_columns(Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(design * scale.asDiagonal()));
}

struct FactoredDesign::Pivoted : Eigen::ColPivHouseholderQR<Eigen::MatrixXd> {
  using ColPivHouseholderQR::ColPivHouseholderQR;
};

FactoredDesign::FactoredDesign(const Eigen::Ref<const Eigen::MatrixXd>& design,
                               const Eigen::Ref<const Eigen::VectorXd>& weights,
                               const DesignNames& names) {
  const std::vector<Eigen::Index> open = factor(design, weights);
  if (!open.empty()) {
    const std::vector<std::string> all_names = names ? names() : std::vector<std::string>();
    std::vector<std::string> open_names;
    open_names.reserve(open.size());
    for (const Eigen::Index j : open) {
      open_names.push_back(name_of(j, all_names));
    }
    const std::string list = joined(open_names);
    throw RankDeficientError("the design does not determine " + list, std::move(open_names));
  }
}

std::vector<Eigen::Index> FactoredDesign::factor(const Eigen::Ref<const Eigen::MatrixXd>& design,
                                                 const Eigen::Ref<const Eigen::VectorXd>& weights) {
  const Eigen::Index n = design.rows();
  const Eigen::Index p = design.cols();
  if (weights.size() != 0 && weights.size() != n) {
    throw DomainError(
        formatted("LeastSquaresDesign: {} weights for {} observations", weights.size(), n));
  }
  if (p == 0 || !design.allFinite() || !weights.allFinite() || !(weights.array() >= 0.0).all()) {
    throw DomainError(
        "LeastSquaresDesign: the design needs at least one column, finite entries, and weights "
        "that are not negative");
  }
  root_weights_ = weights.size() == 0 ? Eigen::VectorXd::Ones(n) : weights.cwiseSqrt().eval();
  observations_ = (root_weights_.array() > 0.0).count();
  scaled_ = root_weights_.asDiagonal() * design;
  scale_ = column_scales(scaled_);
  scaled_ *= scale_.asDiagonal();
  qr_ = std::make_shared<const Pivoted>(scaled_);
  const Pivoted& qr = *qr_;
  std::vector<Eigen::Index> open = open_columns(qr);
  if (!open.empty()) {
    return open;
  }
  R_ = qr.matrixQR().topRows(p).triangularView<Eigen::Upper>();
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(p, p);
  R_.triangularView<Eigen::Upper>().solveInPlace(inverse);
  root_ = qr.colsPermutation() * inverse;
  refines_ = !(bound_of_condition(scaled_, root_) <= refinement_above) &&
             condition_number() > refinement_above;
  // The product scaled_ * root_ is faster to compute, but its columns are less orthogonal: their
  // error is the rounding error times the condition number. It is therefore used only for
  // well-conditioned designs.
  basis_ = refines_ ? Eigen::MatrixXd(qr.householderQ() * Eigen::MatrixXd::Identity(n, p))
                    : Eigen::MatrixXd(scaled_ * root_);
  if (!refines_) {
    qr_.reset();
  }
  return open;
}

double FactoredDesign::smallest_pivot() const {
  const Eigen::Index last = R_.cols() - 1;
  return std::abs(R_(last, last)) / std::abs(R_(0, 0));
}

double FactoredDesign::condition_number() const {
  const Eigen::VectorXd lengths = R_.colwise().norm();
  const Eigen::VectorXd singular =
      Eigen::JacobiSVD<Eigen::MatrixXd>(R_ * lengths.cwiseInverse().asDiagonal()).singularValues();
  return singular(0) / singular(R_.cols() - 1);
}

LeastSquaresDesign::LeastSquaresDesign(const Eigen::Ref<const Eigen::MatrixXd>& design,
                                       const Eigen::Ref<const Eigen::VectorXd>& weights,
                                       const std::vector<std::string>& names)
    : LeastSquaresDesign(FactoredDesign(design, weights, [&] { return names; }), design) {}

LeastSquaresDesign::LeastSquaresDesign(FactoredDesign factored,
                                       const Eigen::Ref<const Eigen::MatrixXd>& design)
    : FactoredDesign(std::move(factored)) {
  if (observations_ < design.rows()) {
    design_ = design;
  }
  leverage_ = basis_.rowwise().squaredNorm();
  const Eigen::VectorXd left = root_weights_ - basis_ * (basis_.transpose() * root_weights_);
  spans_constant_ = left.norm() <= 1e-10 * root_weights_.norm();
  find_unscaled_covariance();
}

void LeastSquaresDesign::find_unscaled_covariance() {
  const Eigen::Index n = scaled_.rows();
  const Eigen::Index p = scaled_.cols();
  Eigen::MatrixXd covariance = root_ * root_.transpose();
  if (refines_) {
    // Column j of (A^T A)^-1 is the solution x of the equations r + A x = 0 and A^T r = -e_j.
    for (Eigen::Index j = 0; j < p; ++j) {
      const Eigen::VectorXd x = covariance.col(j);
      covariance.col(j) = refined(Eigen::VectorXd::Zero(n), -Eigen::VectorXd::Unit(p, j),
                                  {.x = x, .residuals = -scaled_ * x})
                              .x;
    }
    covariance = 0.5 * (covariance + covariance.transpose()).eval();
  }
  unscaled_covariance_ = scale_.asDiagonal() * covariance * scale_.asDiagonal();
}

FactoredDesign::Solution FactoredDesign::solve(const Eigen::VectorXd& weighted_y) const {
  Solution solution;
  if (refines_) {
    solution.x = qr_->solve(weighted_y);
    solution.residuals = weighted_y - scaled_ * solution.x;
    return refined(weighted_y, Eigen::VectorXd::Zero(scaled_.cols()), std::move(solution));
  }
  solution.x = estimates_scaled(weighted_y);
  solution.residuals = weighted_y - scaled_ * solution.x;
  return solution;
}

Eigen::MatrixXd FactoredDesign::estimates_scaled(const Eigen::MatrixXd& weighted_Y) const {
  Eigen::MatrixXd X = root_ * (basis_.transpose() * weighted_Y);
  // one correction step improves the last digits
  X += root_ * (basis_.transpose() * (weighted_Y - scaled_ * X));
  return X;
}

// Solves r + A x = b, A^T r = c by iterative refinement, with A = scaled_. x and the residuals of
// both equations are computed in double-double. The corrections are computed from the QR of A.
FactoredDesign::Solution FactoredDesign::refined(const Eigen::VectorXd& b,
                                                 const Eigen::VectorXd& c,
                                                 Solution start) const {
  const Eigen::Index n = scaled_.rows();
  const Eigen::Index p = scaled_.cols();
  const auto R =  // a triangular view of R_, not a copy
      R_.triangularView<Eigen::Upper>();
  Eigen::VectorXd x = std::move(start.x);
  Eigen::VectorXd x_low = Eigen::VectorXd::Zero(p);
  Eigen::VectorXd r = std::move(start.residuals);
  double last_change = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 20; ++round) {
    Eigen::VectorXd f(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      DoubleDouble sum(b(i));
      sum.add(-r(i));
      for (Eigen::Index j = 0; j < p; ++j) {
        sum.add_product(-scaled_(i, j), x(j));
        sum.add_product(-scaled_(i, j), x_low(j));
      }
      f(i) = sum.value();
    }
    Eigen::VectorXd g(p);
    for (Eigen::Index j = 0; j < p; ++j) {
      DoubleDouble sum(c(j));
      for (Eigen::Index i = 0; i < n; ++i) {
        sum.add_product(-scaled_(i, j), r(i));
      }
      g(j) = sum.value();
    }
    const Eigen::VectorXd h = R.transpose().solve(qr_->colsPermutation().transpose() * g);
    Eigen::VectorXd d = qr_->householderQ().adjoint() * f;
    const Eigen::VectorXd dx = qr_->colsPermutation() * R.solve(d.head(p) - h);
    d.head(p) = h;
    const Eigen::VectorXd dr = qr_->householderQ() * d;
    const double change = dx.norm() + dr.norm();
    if (!(change < last_change)) {
      break;  // the remaining error is rounding
    }
    last_change = change;
    for (Eigen::Index j = 0; j < p; ++j) {
      DoubleDouble sum(x(j));
      sum.add(x_low(j));
      sum.add(dx(j));
      x(j) = sum.value();
      x_low(j) = sum.low();
    }
    r += dr;
    if (dx.norm() <= epsilon * epsilon * x.norm() && dr.norm() <= epsilon * r.norm()) {
      break;
    }
  }
  return {.x = std::move(x), .residuals = std::move(r)};
}

Eigen::VectorXd FactoredDesign::estimate(const Eigen::Ref<const Eigen::VectorXd>& y) const {
  return estimates(y);
}

Eigen::MatrixXd FactoredDesign::estimates(const Eigen::Ref<const Eigen::MatrixXd>& Y) const {
  const Eigen::MatrixXd weighted_Y = root_weights_.asDiagonal() * Y;
  if (!refines_) {
    return scale_.asDiagonal() * estimates_scaled(weighted_Y);
  }
  Eigen::MatrixXd X(scaled_.cols(), Y.cols());
  for (Eigen::Index j = 0; j < Y.cols(); ++j) {
    X.col(j) = solve(weighted_Y.col(j)).x;
  }
  return scale_.asDiagonal() * X;
}

LeastSquaresFit LeastSquaresDesign::fit(
    const Eigen::Ref<const Eigen::VectorXd>& observations) const {
  const Eigen::Index n = scaled_.rows();
  const auto p = static_cast<double>(scaled_.cols());
  if (observations.size() != n || !observations.allFinite()) {
    throw DomainError(formatted("LeastSquaresDesign::fit: {} finite observations are needed", n));
  }
  const Eigen::VectorXd weighted_y = root_weights_.cwiseProduct(observations);
  Solution solution = solve(weighted_y);
  LeastSquaresFit fit;
  fit.estimate = std::move(solution.x);
  fit.estimate.array() *= scale_.array();
  fit.degrees_of_freedom = static_cast<double>(observations_) - p;
  const double rss = solution.residuals.squaredNorm();
  fit.residual_sd =
      fit.degrees_of_freedom > 0.0 ? std::sqrt(rss / fit.degrees_of_freedom) : not_a_number;
  fit.covariance = fit.residual_sd * fit.residual_sd * unscaled_covariance_;
  const double mean =
      spans_constant_ ? root_weights_.dot(weighted_y) / root_weights_.squaredNorm() : 0.0;
  const double total = (weighted_y - mean * root_weights_).squaredNorm();
  fit.r_squared = total > 0.0 ? 1.0 - rss / total : not_a_number;
  fit.leverage = leverage_;
  ResidualDiagnostics diagnostics =
      diagnose_residuals(solution.residuals, leverage_, fit.degrees_of_freedom, p);
  fit.studentized = std::move(diagnostics.studentized);
  fit.cooks_distance = std::move(diagnostics.cooks_distance);
  fit.residuals = std::move(solution.residuals);
  for (Eigen::Index i = 0; i < n; ++i) {
    fit.residuals(i) = root_weights_(i) > 0.0 ? fit.residuals(i) / root_weights_(i)
                                              : observations(i) - design_.row(i).dot(fit.estimate);
  }
  return fit;
}

LeastSquaresFit fit_least_squares(const Eigen::Ref<const Eigen::MatrixXd>& design,
                                  const Eigen::Ref<const Eigen::VectorXd>& observations) {
  return LeastSquaresDesign(design).fit(observations);
}

Eigen::VectorXd variance_inflation(const Eigen::Ref<const Eigen::MatrixXd>& design,
                                   const Eigen::Ref<const Eigen::VectorXd>& weights,
                                   const Eigen::Ref<const Eigen::MatrixXd>& unscaled_covariance) {
  Eigen::VectorXd factors(design.cols());
  const double all = weights.sum();
  for (Eigen::Index j = 0; j < design.cols(); ++j) {
    const auto column = design.col(j);
    const double mean = weights.dot(column) / all;
    double spread = 0.0;
    double size = 0.0;
    for (Eigen::Index i = 0; i < column.size(); ++i) {
      const double off = column(i) - mean;
      spread += weights(i) * off * off;
      size += weights(i) * column(i) * column(i);
    }
    factors(j) = spread > 1e-24 * size ? spread * unscaled_covariance(j, j) : not_a_number;
  }
  return factors;
}

ResidualDiagnostics diagnose_residuals(const Eigen::Ref<const Eigen::VectorXd>& weighted_residuals,
                                       const Eigen::Ref<const Eigen::VectorXd>& leverage,
                                       double degrees_of_freedom,
                                       double parameters) {
  const Eigen::Index n = weighted_residuals.size();
  ResidualDiagnostics result{.studentized = Eigen::VectorXd::Constant(n, not_a_number),
                             .cooks_distance = Eigen::VectorXd::Constant(n, not_a_number)};
  const double rss = weighted_residuals.squaredNorm();
  if (!(rss > 0.0) || !(degrees_of_freedom > 0.0)) {
    return result;
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const double rest = 1.0 - leverage(i);
    if (!(rest > 1e-12)) {
      continue;  // the fit passes through this observation
    }
    const double squared = weighted_residuals(i) * weighted_residuals(i);
    result.cooks_distance(i) =
        squared * leverage(i) / (parameters * (rss / degrees_of_freedom) * rest * rest);
    const double without = (rss - squared / rest) / (degrees_of_freedom - 1.0);
    if (degrees_of_freedom > 1.0 && without > 1e-14 * rss) {
      result.studentized(i) = weighted_residuals(i) / std::sqrt(without * rest);
    }
  }
  return result;
}

ResidualDiagnostics scale_residuals(const Eigen::Ref<const Eigen::VectorXd>& weighted_residuals,
                                    const Eigen::Ref<const Eigen::VectorXd>& leverage,
                                    double scatter,
                                    double parameters) {
  const Eigen::ArrayXd rest = (1.0 - leverage.array()).max(1e-12);
  const Eigen::ArrayXd t = weighted_residuals.array() / (scatter * rest.sqrt());
  return {.studentized = t.matrix(),
          .cooks_distance = (t.square() * leverage.array() / (parameters * rest)).matrix()};
}

}  // namespace axiscal
