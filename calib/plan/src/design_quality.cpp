// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/design_quality.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/LU>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

Eigen::MatrixXd field_rows(const std::vector<DesignEntry>& design,
                           const Positioner& positioner,
                           const Eigen::Vector3d& direction) {
  Eigen::MatrixXd X(static_cast<Eigen::Index>(design.size()), 4);
  for (std::size_t i = 0; i < design.size(); ++i) {
    const Eigen::Matrix3d& R = positioner.rotation_table_from_positioner(design[i].point);
    X.row(static_cast<Eigen::Index>(i)) << 1.0,
        design[i].level.of_all() * (R.transpose() * direction).transpose();
  }
  return X;
}

Eigen::MatrixXd orientation_rows(const std::vector<DesignEntry>& design) {
  const Positioner cube;
  Eigen::MatrixXd X(static_cast<Eigen::Index>(design.size()), 10);
  for (std::size_t i = 0; i < design.size(); ++i) {
    const Eigen::Matrix3d& R = cube.rotation_table_from_positioner(design[i].point);
    X.row(static_cast<Eigen::Index>(i)) << 1.0, R.reshaped().transpose();
  }
  return X;
}

// Returns the unit vector u that maximises u^T A u + 2 c^T u, with A positive semidefinite. Each
// step replaces u by A u + c, normalised, which cannot decrease this value. The search starts from
// both ends of each principal axis of A. If all directions have equal values, as in the best
// designs, the result is the axis z.
Eigen::Vector3d worst_direction(const Eigen::Matrix3d& A, const Eigen::Vector3d& c) {
  const auto value = [&](const Eigen::Vector3d& u) { return u.dot(A * u) + 2.0 * c.dot(u); };
  const Eigen::Matrix3d axes = symmetric_eigen(A).vectors;
  Eigen::Vector3d best = Eigen::Vector3d::UnitZ();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      Eigen::Vector3d u = sign * axes.col(axis);
      for (int round = 0; round < 1000; ++round) {
        const Eigen::Vector3d next = (A * u + c).normalized();
        const bool stays = (next - u).norm() < 1e-12;
        u = next;
        if (stays) {
          break;
        }
      }
      constexpr double rounding = 1e-12;
      best = value(u) > (1.0 + rounding) * value(best) ? u : best;
    }
  }
  return best;
}

double log_determinant(const Eigen::MatrixXd& information) {
  return symmetric_eigen(information).values.array().max(1e-300).log().sum();
}

// Returns det(X^T X / n)^(1/p), divided by its value for evenly spread directions, for which
// X^T X / n is diag(1, 1/3, .., 1/3).
double d_efficiency(const Eigen::MatrixXd& X) {
  const auto n = static_cast<double>(X.rows());
  const auto p = static_cast<double>(X.cols());
  const double best = -(p - 1.0) * std::log(3.0);
  return std::exp((log_determinant(X.transpose() * X / n) - best) / p);
}

}  // namespace

DesignQuality assess_design(const std::vector<DesignEntry>& design,
                            const Positioner& positioner,
                            const Eigen::Vector3d& field_in_table) {
  if (design.empty() || !(field_in_table.norm() > 0.0)) {
    throw DomainError("assess_design: a design point and a field that is not zero are needed");
  }
  const Eigen::MatrixXd X = field_rows(design, positioner, field_in_table.normalized());
  DesignQuality quality;
  const double infinite = std::numeric_limits<double>::infinity();
  quality.largest_prediction_variance = infinite;
  quality.variance_inflation.setConstant(infinite);
  if (X.rows() < 4 || !undetermined_columns(X).empty()) {
    return quality;
  }
  const LeastSquaresDesign factored(X);
  const Eigen::Matrix4d C = factored.unscaled_covariance();
  const auto n = static_cast<double>(X.rows());
  quality.determined = true;
  quality.d_efficiency = d_efficiency(X);
  quality.a_efficiency = 10.0 / (n * C.trace());
  quality.worst_direction = worst_direction(C.bottomRightCorner<3, 3>(), C.block<3, 1>(1, 0));
  Eigen::Vector4d x;
  x << 1.0, quality.worst_direction;
  quality.largest_prediction_variance = x.dot(C * x);
  quality.g_efficiency = 4.0 / (n * quality.largest_prediction_variance);
  quality.variance_inflation = variance_inflation(X, Eigen::VectorXd::Ones(X.rows()), C).tail<3>();
  return quality;
}

OptimalDesign optimal_design(int points,
                             const Eigen::Vector3d& field_in_table,
                             std::uint64_t seed) {
  const std::vector<DesignEntry> candidates = standard_design(24);
  if (points < 4 || points > static_cast<int>(candidates.size())) {
    throw DomainError(
        formatted("optimal_design: the number of points must be 4 to 24, not {}", points));
  }
  constexpr int fewest_for_every_direction = 10;
  const bool every_direction = points >= fewest_for_every_direction;
  const auto rows = [&](const std::vector<DesignEntry>& design) {
    return every_direction ? orientation_rows(design)
                           : field_rows(design, Positioner(), field_in_table.normalized());
  };
  const Eigen::MatrixXd X = rows(candidates);
  const auto value = [&](const std::vector<std::size_t>& order) {
    Eigen::MatrixXd M = 1e-9 * Eigen::MatrixXd::Identity(X.cols(), X.cols());
    for (std::size_t i = 0; i < static_cast<std::size_t>(points); ++i) {
      const Eigen::RowVectorXd row = X.row(static_cast<Eigen::Index>(order[i]));
      M += row.transpose() * row;
    }
    return log_determinant(M);
  };
  RandomStream random(seed, 2);
  std::vector<std::size_t> best;
  double best_value = -std::numeric_limits<double>::infinity();
  constexpr int starts = 30;
  for (int start = 0; start < starts; ++start) {
    std::vector<std::size_t> order(candidates.size());
    std::iota(order.begin(), order.end(), 0U);
    random.shuffle(std::span(order));
    double current = value(order);
    bool better = true;
    while (better) {
      better = false;
      for (std::size_t in = 0; in < static_cast<std::size_t>(points); ++in) {
        for (auto out = static_cast<std::size_t>(points); out < order.size(); ++out) {
          std::swap(order[in], order[out]);
          const double next = value(order);
          if (next > current + 1e-9) {
            current = next;
            better = true;
          } else {
            std::swap(order[in], order[out]);
          }
        }
      }
    }
    if (current > best_value + 1e-9) {
      best_value = current;
      best = order;
    }
  }
  best.resize(static_cast<std::size_t>(points));
  std::sort(best.begin(), best.end());
  OptimalDesign result{.design = {}, .parameters = every_direction ? 10 : 4};
  for (const std::size_t i : best) {
    result.design.push_back(candidates[i]);
  }
  result.d_efficiency = d_efficiency(rows(result.design));
  result.d_efficiency_of_standard = d_efficiency(rows(standard_design(12)));
  return result;
}

}  // namespace axiscal
