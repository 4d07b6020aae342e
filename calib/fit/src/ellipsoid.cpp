// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/ellipsoid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "axiscal/core/not_a_number.hpp"
#include "calib/regression/factor.hpp"
#include "kernels/ellipsoid_rows.hpp"

namespace axiscal {
namespace {

std::array<std::array<double, 3>, 3> rows_of(const Eigen::Matrix3d& M) {
  std::array<std::array<double, 3>, 3> rows{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      rows[i][j] = M(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  return rows;
}

EllipsoidReadings readings_of(const EllipsoidCloud& cloud, const Ellipsoid& at) {
  const double* const v = cloud.v.data();
  const Eigen::Index n = cloud.size();
  return {.v = {v, v + n, v + 2 * n},
          .n = static_cast<std::size_t>(n),
          .A = rows_of(at.A),
          .b = {at.b.x(), at.b.y(), at.b.z()}};
}

void linearise_ellipsoid(const EllipsoidCloud& cloud,
                         const Ellipsoid& at,
                         LinearisedEllipsoid& result) {
  const Eigen::Index n = cloud.size();
  result.scale.resize(n);
  result.residuals.resize(n);
  result.jacobian.resize(n, ellipsoid_parameters);
  EllipsoidRows rows{.scale = result.scale.data(), .residuals = result.residuals.data()};
  for (std::size_t j = 0; j < rows.jacobian.size(); ++j) {
    rows.jacobian[j] = result.jacobian.col(static_cast<Eigen::Index>(j)).data();
  }
  ellipsoid_rows(readings_of(cloud, at),
                 {.root_weights = cloud.root_weights.data(),
                  .C = rows_of(at.A * cloud.noise * at.A.transpose()),
                  .symmetric = cloud.shape == MagnitudeShape::symmetric},
                 rows);
}

class EllipsoidProblem {
 public:
  using State = Ellipsoid;
  using Linear = LinearisedEllipsoid;

  EllipsoidProblem(const EllipsoidCloud& cloud, const Eigen::VectorXd& robust)
      : cloud_(cloud), root_(robust.cwiseSqrt()) {}

  void linearise(const Ellipsoid& at, Linear& linear) const {
    linearise_ellipsoid(cloud_, at, linear);
    if (root_.size() > 0) {
      linear.residuals.array() *= root_.array();
      linear.jacobian.array().colwise() *= root_.array();
      linear.scale.array() *= root_.array();
    }
  }
  [[nodiscard]] Ellipsoid moved(const Ellipsoid& at, const EllipsoidParameters& step) const {
    return moved_ellipsoid(at, step, cloud_.shape);
  }
  [[nodiscard]] double cost(const Ellipsoid& at, const Linear& before) const {
    return at.A.determinant() > 0.0 ? ellipsoid_cost(cloud_, at, before.scale) : not_a_number;
  }
  [[nodiscard]] static double length(const Ellipsoid& /*at*/,
                                     const EllipsoidParameters& step,
                                     const Linear& /*there*/) {
    return step.norm();
  }

 private:
  const EllipsoidCloud& cloud_;
  Eigen::VectorXd root_;
};

// Returns the symmetric or triangular matrix A with A^T A = M, for an ellipsoid d^T M d = 1.
Eigen::Matrix3d root_of(const Eigen::Matrix3d& M, MagnitudeShape shape) {
  if (shape == MagnitudeShape::triangular) {
    // M = A^T A with A upper triangular: Cholesky's M = L L^T, A = L^T.
    return Whitening(M).root().transpose();
  }
  const SymmetricEigen eigen = symmetric_eigen(M);
  return eigen.vectors * eigen.values.cwiseAbs().cwiseSqrt().asDiagonal() *
         eigen.vectors.transpose();
}

// Solves a least-squares problem approximately, for a starting point. It uses the normal equations
// if they are well conditioned.
Eigen::VectorXd roughly_solved(Eigen::MatrixXd A, const Eigen::VectorXd& b) {
  constexpr double smallest_pivot = 1e-4;
  const Linearised linear{.residuals = -b, .jacobian = std::move(A)};
  const auto solution = step_by_normal_equations(linear, 0.0, smallest_pivot);
  return solution ? *solution : minimum_norm_solution(linear.jacobian, b);
}

}  // namespace

Ellipsoid moved_ellipsoid(const Ellipsoid& from,
                          const EllipsoidParameters& step,
                          MagnitudeShape shape) {
  Ellipsoid to = from;
  to.b += step.head<3>();
  for (std::size_t e = 0; e < ellipsoid_entries.size(); ++e) {
    const auto [i, j] = ellipsoid_entries[e];
    to.A(i, j) += step(3 + static_cast<Eigen::Index>(e));
    if (i != j && shape == MagnitudeShape::symmetric) {
      to.A(j, i) = to.A(i, j);
    }
  }
  return to;
}

LinearisedEllipsoid linearise_ellipsoid(const EllipsoidCloud& cloud, const Ellipsoid& at) {
  LinearisedEllipsoid result;
  linearise_ellipsoid(cloud, at, result);
  return result;
}

double ellipsoid_cost(const EllipsoidCloud& cloud,
                      const Ellipsoid& at,
                      const Eigen::VectorXd& scale) {
  return ellipsoid_squares(readings_of(cloud, at), scale.data());
}

Ellipsoid sphere_through(const EllipsoidCloud& cloud) {
  const Eigen::Index n = cloud.size();
  Eigen::MatrixXd B(n, 4);
  B << 2.0 * cloud.v, Eigen::VectorXd::Ones(n);
  const Eigen::Vector4d found = roughly_solved(std::move(B), cloud.v.rowwise().squaredNorm());
  Ellipsoid sphere{.b = found.head<3>()};
  sphere.A /= std::sqrt(std::max(found(3) + sphere.b.squaredNorm(), 1e-6));
  return sphere;
}

Ellipsoid ellipsoid_start(const EllipsoidCloud& cloud) {
  const Eigen::Index n = cloud.size();
  const Eigen::Array<double, Eigen::Dynamic, 3> v = cloud.v.array();
  Eigen::MatrixXd D(n, 9);
  D.leftCols<3>() = v.square();
  D.col(3) = 2.0 * v.col(0) * v.col(1);
  D.col(4) = 2.0 * v.col(0) * v.col(2);
  D.col(5) = 2.0 * v.col(1) * v.col(2);
  D.rightCols<3>() = 2.0 * v;
  const EllipsoidParameters q = roughly_solved(std::move(D), Eigen::VectorXd::Ones(n));
  Eigen::Matrix3d Q;
  Q << q(0), q(3), q(4), q(3), q(1), q(5), q(4), q(5), q(2);
  const PositiveFactor cholesky(Q);
  constexpr double longest_axis = 100.0;  // a good ellipsoid's axes are all near 1
  if (cholesky.is_determined()) {
    const Eigen::Vector3d centre = -cholesky.solve(q.tail<3>()).col(0);
    const double size = 1.0 + centre.dot(Q * centre);
    const Eigen::Matrix3d A = root_of(Q / size, cloud.shape);
    if (A.inverse().norm() < longest_axis) {
      return {.b = centre, .A = A};
    }
  }
  return sphere_through(cloud);
}

Ellipsoid converged_ellipsoid(const EllipsoidCloud& cloud,
                              const Ellipsoid& start,
                              const Eigen::VectorXd& robust) {
  return gauss_newton(EllipsoidProblem(cloud, robust), start).state;
}

}  // namespace axiscal
