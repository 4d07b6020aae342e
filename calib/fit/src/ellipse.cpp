// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/LU>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/fit/magnitude.hpp"
#include "calib/fit/src/axis_regression.hpp"
#include "calib/regression/factor.hpp"
#include "calib/regression/gauss_newton.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr Eigen::Index parameters = 5;  // two components of b, and three entries of the symmetric A

// The ellipse of the readings v with |A (v - b)| = 1. A is symmetric.
struct Ellipse {
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();
};

[[noreturn]] void refuse_shape() {
  throw RefusedError(
      "the readings of the two axes do not lie on an ellipse: turn the instrument by one "
      "revolution about the axis perpendicular to both, in one place, and take readings during the "
      "whole revolution");
}

// Returns the conic with the least sum of squared algebraic residuals.
Ellipse conic_through(const Eigen::MatrixX2d& v) {
  Eigen::MatrixXd D(v.rows(), 6);
  for (Eigen::Index i = 0; i < v.rows(); ++i) {
    const double x = v(i, 0);
    const double y = v(i, 1);
    D.row(i) << x * x, 2.0 * x * y, y * y, 2.0 * x, 2.0 * y, 1.0;
  }
  const Eigen::VectorXd q = singular_values(D).V.col(5);
  Eigen::Matrix2d Q;
  Q << q(0), q(1), q(1), q(2);
  const double sign = Q.trace() < 0.0 ? -1.0 : 1.0;
  Q *= sign;
  const Eigen::Vector2d d = sign * q.segment<2>(3);
  if (!(Q.determinant() > 1e-9 * Q.squaredNorm())) {
    refuse_shape();
  }
  Ellipse at{.b = -Q.inverse() * d};
  const double size = at.b.dot(Q * at.b) - sign * q(5);
  if (!(size > 0.0)) {
    refuse_shape();
  }
  const SymmetricEigen eigen = symmetric_eigen(Q / size);
  at.A = eigen.vectors * eigen.values.cwiseSqrt().asDiagonal() * eigen.vectors.transpose();
  return at;
}

// The problem for gauss_newton(): fits an ellipse to the readings of two axes.
class EllipseProblem {
 public:
  using State = Ellipse;
  struct Linear : Linearised {
    Eigen::VectorXd root_weights;  // n: factors of the deviations |A (v - b)| - 1
  };

  EllipseProblem(const Eigen::MatrixX2d& v, const Eigen::VectorXd& root_weights)
      : v_(v), root_weights_(root_weights) {}

  // Computes the deviations |A (v - b)| - 1 and their derivatives with respect to b, A11, A12 and
  // A22. Both are scaled so that readings with noise of standard deviation 1 give deviations of
  // standard deviation 1.
  void linearise(const Ellipse& at, Linear& linear) const {
    linear.residuals.resize(v_.rows());
    linear.jacobian.resize(v_.rows(), parameters);
    linear.root_weights.resize(v_.rows());
    for (Eigen::Index i = 0; i < v_.rows(); ++i) {
      const Eigen::Vector2d e = v_.row(i).transpose() - at.b;
      const Eigen::Vector2d f = at.A * e;
      const Eigen::Vector2d u = f.normalized();
      const Eigen::Vector2d along = at.A * u;  // derivative of |f| with respect to the reading
      const double w = root_weights_(i) / along.norm();
      linear.root_weights(i) = w;
      linear.residuals(i) = w * (f.norm() - 1.0);
      linear.jacobian.row(i) << -w * along.x(), -w * along.y(), w * u.x() * e.x(),
          w * (u.x() * e.y() + u.y() * e.x()), w * u.y() * e.y();
    }
  }

  [[nodiscard]] Ellipse moved(Ellipse at, const Eigen::VectorXd& step) const {
    at.b += step.head<2>();
    at.A(0, 0) += step(2);
    at.A(0, 1) += step(3);
    at.A(1, 0) += step(3);
    at.A(1, 1) += step(4);
    return at;
  }

  [[nodiscard]] double cost(const Ellipse& at, const Linear& linear) const {
    if (!(at.A.determinant() > 0.0)) {
      return std::numeric_limits<double>::infinity();
    }
    const Eigen::MatrixX2d f = (v_.rowwise() - at.b.transpose()) * at.A;
    return (f.rowwise().norm().array() - 1.0)
        .matrix()
        .cwiseProduct(linear.root_weights)
        .squaredNorm();
  }

  // The readings are scaled to size 1, so the norm of a step is its relative length.
  [[nodiscard]] double length(const Ellipse& /*at*/,
                              const Eigen::VectorXd& step,
                              const Linear& /*linear*/) const {
    return step.norm();
  }

 private:
  const Eigen::MatrixX2d& v_;
  const Eigen::VectorXd& root_weights_;
};

}  // namespace

Estimate estimate_ellipse(const ReadingSet& set, double F) {
  constexpr Eigen::Index fewest = parameters + 3;
  if (set.size() < fewest) {
    throw RefusedError(
        formatted("the method 'magnitude' needs at least {} readings of two axes, but there are {}",
                  fewest, set.size()));
  }
  require_response(set);
  const Eigen::Vector2d lowest = set.response.colwise().minCoeff();
  const Eigen::Vector2d highest = set.response.colwise().maxCoeff();
  const Eigen::Vector2d middle = 0.5 * (lowest + highest);
  const double size = 0.5 * (highest - lowest).maxCoeff();
  const Eigen::MatrixX2d v = (set.response.rowwise() - middle.transpose()) / size;
  const Eigen::VectorXd root_weights = set.weights.col(0).cwiseSqrt();
  const EllipseProblem problem(v, root_weights);
  const Ellipse at = gauss_newton(problem, conic_through(v)).state;
  EllipseProblem::Linear linear;
  problem.linearise(at, linear);
  const std::vector<std::string> names = {
      set.axes[0] + ".bias", set.axes[1] + ".bias", set.axes[0] + ".sensitivity.x",
      set.axes[0] + ".sensitivity.y", set.axes[1] + ".sensitivity.y"};
  const LeastSquaresDesign design(linear.jacobian, Eigen::VectorXd(), names);
  const auto dof = static_cast<double>(set.size() - parameters);
  const double sd = std::sqrt(linear.residuals.squaredNorm() / dof);
  const Eigen::MatrixXd& C = design.unscaled_covariance();
  constexpr double largest_relative_se = 0.1;
  const double worst = sd * std::sqrt(C.diagonal().maxCoeff());
  if (!(worst < largest_relative_se)) {
    throw RefusedError(formatted(
        "method 'magnitude': the readings do not separate bias and sensitivity (standard errors of "
        "{} % of the field): turn the instrument by a whole revolution, and keep it level",
        number_text(std::round(100.0 * worst))));
  }

  Estimate estimate;
  const Eigen::Matrix2d S = at.A.inverse();
  estimate.response.bias = middle + size * at.b;
  estimate.response.sensitivity = SensitivityMatrix::Zero(2, 3);
  estimate.response.sensitivity.leftCols(2) = size / F * S;
  RegressionRows rows = rows_of_readings(set);
  estimate.statistics = blank_statistics(set, rows);
  FitStatistics& statistics = estimate.statistics;
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(8, parameters);
  T(0, 0) = size;
  T(4, 1) = size;
  const std::array<std::pair<int, int>, 3> entries = {{{0, 0}, {0, 1}, {1, 1}}};
  for (std::size_t e = 0; e < entries.size(); ++e) {
    Eigen::Matrix2d dA = Eigen::Matrix2d::Zero();
    dA(entries[e].first, entries[e].second) = 1.0;
    dA(entries[e].second, entries[e].first) = 1.0;
    const Eigen::Matrix2d dS = -size / F * (S * dA * S);
    for (Eigen::Index k = 0; k < 2; ++k) {
      T.block<2, 1>(4 * k + 1, 2 + static_cast<Eigen::Index>(e)) = dS.row(k).transpose();
    }
  }
  statistics.covariance = sd * sd * T * C * T.transpose();
  statistics.degrees_of_freedom.setConstant(dof);
  statistics.residual_sd.setConstant(size * sd);
  statistics.r_squared.setConstant(not_a_number);
  statistics.variance_inflation.setConstant(not_a_number);
  statistics.condition_number = design.condition_number();
  const ResidualDiagnostics diagnostics =
      diagnose_residuals(linear.residuals, design.leverage(), dof, static_cast<double>(parameters));
  for (Eigen::Index k = 0; k < 2; ++k) {
    put_diagnostics(statistics, k, design.leverage(), diagnostics, Eigen::VectorXd());
  }
  estimate.notes.push_back(
      {NoteCode::method,
       formatted(
           "the two axes were turned in a plane; the field's component in this plane is assumed to "
           "have the length {}. If the field is inclined to the plane, give the length of this "
           "component",
           number_text(F, 6))});
  return estimate;
}

}  // namespace axiscal
