// SPDX-License-Identifier: Apache-2.0
#include "small_joint.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <Eigen/Eigenvalues>

#include "axiscal/calib/scaled_cholesky.hpp"
#include "axiscal/calib/shared_fit.hpp"
#include "axiscal/calib/small_run.hpp"
#include "axiscal/core/rotation.hpp"

namespace axiscal {
namespace {

// What is left of a column's square beside others, where normal equations do.
constexpr double clearly_determined = 1e-4;

// From a field in the table to what each reading met of it.
class MetOfField {
 public:
  explicit MetOfField(const ReadingSet& set) : count_(set.readings.size()) {
    const std::string_view level = set.field.parts().front().level_name();
    for (std::size_t i = 0; i < count_; ++i) {
      met_[i] = set.readings[i].level.of(level) * set.rotation_sensor_from_table[i];
    }
  }

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] const Eigen::Matrix3d& operator[](std::size_t i) const { return met_[i]; }

 private:
  std::size_t count_;
  std::array<Eigen::Matrix3d, SmallState::most_readings> met_;
};

// b and S fitted for a field, as sums over the readings.
struct FittedSums {
  std::array<DirectionSums, 3> of_axes;
  Eigen::Matrix<double, 2, 3> squares_of_directions;  // what they change of each axis at all

  [[nodiscard]] double cost(const Eigen::Vector3d& sigma) const {
    double sum = 0.0;
    for (Eigen::Index k = 0; k < 3; ++k) {
      sum += of_axes[static_cast<std::size_t>(k)].squares / (sigma(k) * sigma(k));
    }
    return sum;
  }
};

class SmallJoint {
 public:
  explicit SmallJoint(const ReadingSet& set) : set_(set), met_(set) {}

  [[nodiscard]] std::optional<FittedSums> at(const Eigen::Vector3d& field) const {
    using Coefficients = Eigen::Matrix<double, 4, 3>;
    using OfDirections = Eigen::Matrix<double, 4, 6>;
    const std::size_t n = met_.count();
    std::array<Eigen::Vector4d, SmallState::most_readings> X;
    Eigen::Matrix4d N = Eigen::Matrix4d::Zero();
    Coefficients right = Coefficients::Zero();
    for (std::size_t i = 0; i < n; ++i) {
      X[i] << 1.0, met_[i] * field;
      N.noalias() += X[i].lazyProduct(X[i].transpose());
      right.noalias() += X[i].lazyProduct(response(i));
    }
    const ScaledCholeskyOf<Eigen::Matrix4d> cholesky(N);
    if (!cholesky.is_determined(clearly_determined)) {
      return std::nullopt;
    }
    const Eigen::Matrix4d inverse = cholesky.inverse();
    Coefficients c = inverse * right;
    right.setZero();
    for (std::size_t i = 0; i < n; ++i) {  // the last digits
      right.noalias() += X[i].lazyProduct(response(i) - X[i].transpose().lazyProduct(c));
    }
    c += inverse * right;
    const Eigen::Matrix3d S = c.bottomRows<3>().transpose();
    const Eigen::Matrix<double, 3, 2> tangents = field.norm() * tangents_of(field);
    OfDirections with_own = OfDirections::Zero();
    Eigen::Matrix<double, 4, 3> left = Eigen::Matrix<double, 4, 3>::Zero();
    FittedSums sums;
    for (DirectionSums& own : sums.of_axes) {
      own = {.information = Eigen::Matrix2d::Zero(),
             .gradient = Eigen::Vector2d::Zero(),
             .degrees_of_freedom = static_cast<double>(n) - 4.0};
    }
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::RowVector3d residual = response(i) - X[i].transpose().lazyProduct(c);
      const Eigen::Matrix<double, 3, 2> changes = S.lazyProduct(met_[i].lazyProduct(tangents));
      left.noalias() += X[i].lazyProduct(residual);
      for (Eigen::Index k = 0; k < 3; ++k) {
        DirectionSums& own = sums.of_axes[static_cast<std::size_t>(k)];
        const Eigen::RowVector2d change = changes.row(k);
        own.information.noalias() += change.transpose().lazyProduct(change);
        own.gradient += residual(k) * change.transpose();
        own.squares += residual(k) * residual(k);
        with_own.middleCols<2>(2 * k).noalias() += X[i].lazyProduct(change);
      }
    }
    const OfDirections take_up = inverse * with_own;
    for (Eigen::Index k = 0; k < 3; ++k) {
      DirectionSums& own = sums.of_axes[static_cast<std::size_t>(k)];
      const auto up = take_up.middleCols<2>(2 * k).transpose();
      sums.squares_of_directions.col(k) = own.information.diagonal();
      own.information.noalias() -= up.lazyProduct(with_own.middleCols<2>(2 * k));
      own.gradient.noalias() -= up.lazyProduct(left.col(k));
    }
    return sums;
  }

  // Moves a field and its sums to where they are least, as JointFit::converged() does.
  // @return false where that is not plain.
  bool converge(const Eigen::Vector3d& sigma, Eigen::Vector3d& field, FittedSums& sums) const {
    constexpr int most_rounds = 20;
    constexpr double still_rad = 1e-14;
    for (int round = 0; round < most_rounds; ++round) {
      Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
      Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
      Eigen::Vector2d squares = Eigen::Vector2d::Zero();
      for (Eigen::Index k = 0; k < 3; ++k) {
        const DirectionSums& own = sums.of_axes[static_cast<std::size_t>(k)];
        const double weight = 1.0 / (sigma(k) * sigma(k));
        information += weight * own.information;
        gradient += weight * own.gradient;
        squares += weight * sums.squares_of_directions.col(k);
      }
      // b and S must leave enough of what the directions change.
      const ScaledCholeskyOf<Eigen::Matrix2d> cholesky(information);
      if (!cholesky.is_determined(clearly_determined) ||
          !(information.diagonal().array() > clearly_determined * squares.array()).all()) {
        return false;
      }
      const Eigen::Vector2d step = cholesky.solve(gradient);
      constexpr double longest_step_rad = 0.5;
      if (!(step.norm() < longest_step_rad)) {
        return false;
      }
      if (step.norm() < still_rad) {
        return true;
      }
      const Eigen::Vector3d next =
          field.norm() * (field.normalized() + tangents_of(field) * step).normalized();
      const std::optional<FittedSums> there = at(next);
      // Near the minimum the cost's own rounding must not stop the last steps.
      if (!there || !(there->cost(sigma) <= (1.0 + 1e-12) * sums.cost(sigma))) {
        return false;
      }
      field = next;
      sums = *there;
    }
    return false;
  }

 private:
  [[nodiscard]] Eigen::RowVector3d response(std::size_t i) const {
    return set_.response.row(static_cast<Eigen::Index>(i));
  }
  const ReadingSet& set_;
  MetOfField met_;
};

}  // namespace

std::optional<SmallJointSolution> solve_small_joint(const ReadingSet& set,
                                                    const Eigen::Vector3d& start,
                                                    const Eigen::Vector3d& smallest) {
  const SmallJoint fit(set);
  SmallJointSolution solution{.field = start, .sigma = Eigen::Vector3d::Ones()};
  std::optional<FittedSums> sums = fit.at(start);
  if (!sums || !fit.converge(solution.sigma, solution.field, *sums)) {
    return std::nullopt;
  }
  double squares = 0.0;
  double freedom = -2.0;
  for (const DirectionSums& own : sums->of_axes) {
    squares += own.squares;
    freedom += own.degrees_of_freedom;
  }
  constexpr double fewest_degrees_of_freedom = 1.0;
  if (!(freedom > fewest_degrees_of_freedom)) {
    return std::nullopt;
  }
  solution.sigma.setConstant(std::max(std::sqrt(squares / freedom), smallest.maxCoeff()));
  constexpr int most_rounds = 10;
  for (int round = 0; round < most_rounds; ++round) {
    const std::optional<DirectionFit> next =
        fit_shared(sums->of_axes, solution.sigma.cwiseAbs2(), smallest.cwiseAbs2());
    // What is near the fewest is asked of the whole fit.
    constexpr double clearly_enough = 1.5 * fewest_degrees_of_freedom;
    if (!next || !(next->degrees_of_freedom.minCoeff() > clearly_enough)) {
      return std::nullopt;
    }
    const Eigen::Vector3d sigma = next->variance.cwiseSqrt();
    const double change = (sigma.array() / solution.sigma.array()).log().abs().maxCoeff();
    solution.sigma = sigma;
    if (!fit.converge(solution.sigma, solution.field, *sums)) {
      return std::nullopt;
    }
    constexpr double still = 1e-10;
    if (change < still) {
      return solution;
    }
  }
  return std::nullopt;
}

std::optional<Eigen::Vector3d> small_linear_direction(const ReadingSet& set) {
  constexpr int unknowns = 10;
  using Row = Eigen::Matrix<double, unknowns, 1>;
  using Square = Eigen::Matrix<double, unknowns, unknowns>;
  if (set.size() < unknowns) {
    return std::nullopt;
  }
  const MetOfField met(set);
  Square N = Square::Zero();
  Eigen::Matrix<double, unknowns, 3> right = Eigen::Matrix<double, unknowns, 3>::Zero();
  for (std::size_t i = 0; i < met.count(); ++i) {
    Row row;
    row << 1.0, met[i].reshaped();
    N.noalias() += row.lazyProduct(row.transpose());
    right.noalias() += row.lazyProduct(set.response.row(static_cast<Eigen::Index>(i)));
  }
  const ScaledCholeskyOf<Square> cholesky(N);
  if (!cholesky.is_determined(clearly_determined)) {
    return std::nullopt;
  }
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();  // of S_k f^T of all axes
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Row x = cholesky.solve(right.col(k));
    const Eigen::Matrix3d M = x.tail<9>().reshaped(3, 3);
    squares.noalias() += M.transpose().lazyProduct(M);
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(squares);
  const Eigen::Vector3d& values = solver.eigenvalues();
  constexpr double clearly_largest = 0.25;  // of the largest
  if (!(values(1) < clearly_largest * values(2))) {
    return std::nullopt;
  }
  return solver.eigenvectors().col(2);
}

}  // namespace axiscal
