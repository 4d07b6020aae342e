// SPDX-License-Identifier: Apache-2.0
#include "ellipsoid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "axiscal/calib/minimum_norm.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {
namespace {

// The readings are held by columns, so that all steps are arithmetic on whole arrays.
void linearise_ellipsoid(const EllipsoidCloud& cloud,
                         const Ellipsoid& at,
                         LinearisedEllipsoid& result) {
  using Columns = Eigen::Array<double, Eigen::Dynamic, 3>;
  const Eigen::Matrix3d C = at.A * cloud.noise * at.A.transpose();
  const Columns d = (cloud.v.rowwise() - at.b.transpose()).array();
  Columns u(d.rows(), 3);
  for (int j = 0; j < 3; ++j) {
    u.col(j) = at.A(j, 0) * d.col(0) + at.A(j, 1) * d.col(1) + at.A(j, 2) * d.col(2);
  }
  const Eigen::ArrayXd length = (u.col(0).square() + u.col(1).square() + u.col(2).square()).sqrt();
  u.colwise() /= length;
  result.scale =
      cloud.root_weights.array() /
      (C(0, 0) * u.col(0).square() + C(1, 1) * u.col(1).square() + C(2, 2) * u.col(2).square() +
       2.0 * (C(0, 1) * u.col(0) * u.col(1) + C(0, 2) * u.col(0) * u.col(2) +
              C(1, 2) * u.col(1) * u.col(2)))
          .sqrt();
  result.residuals = result.scale.array() * (length - 1.0);
  u.colwise() *= result.scale.array();
  result.jacobian.resize(d.rows(), ellipsoid_parameters);
  for (int j = 0; j < 3; ++j) {
    result.jacobian.col(j) =
        -(at.A(0, j) * u.col(0) + at.A(1, j) * u.col(1) + at.A(2, j) * u.col(2));
  }
  for (std::size_t e = 0; e < ellipsoid_entries.size(); ++e) {
    const auto [j, k] = ellipsoid_entries[e];
    auto column = result.jacobian.col(3 + static_cast<Eigen::Index>(e));
    column = u.col(j) * d.col(k);
    if (j != k && cloud.shape == MagnitudeShape::symmetric) {
      column.array() += u.col(k) * d.col(j);
    }
  }
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

// The symmetric or triangular A of an ellipsoid d^T M d = 1.
Eigen::Matrix3d root_of(const Eigen::Matrix3d& M, MagnitudeShape shape) {
  if (shape == MagnitudeShape::triangular) {
    // M = A^T A with A upper triangular: Cholesky's M = L L^T, A = L^T.
    return Eigen::LLT<Eigen::Matrix3d>(M).matrixL().transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU);
  return svd.matrixU() * svd.singularValues().cwiseSqrt().asDiagonal() * svd.matrixU().transpose();
}

// Least squares for a start: by the normal equations where they are well conditioned.
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
  Eigen::ArrayXd squares = Eigen::ArrayXd::Zero(cloud.size());
  for (int j = 0; j < 3; ++j) {
    squares += (at.A(j, 0) * (cloud.v.col(0).array() - at.b(0)) +
                at.A(j, 1) * (cloud.v.col(1).array() - at.b(1)) +
                at.A(j, 2) * (cloud.v.col(2).array() - at.b(2)))
                   .square();
  }
  return (scale.array() * (squares.sqrt() - 1.0)).square().sum();
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
  const Eigen::LLT<Eigen::Matrix3d> cholesky(Q);
  constexpr double longest_axis = 100.0;  // a good ellipsoid's axes are all near 1
  if (cholesky.info() == Eigen::Success) {
    const Eigen::Vector3d centre = -cholesky.solve(q.tail<3>());
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
