// SPDX-License-Identifier: Apache-2.0
// Fits of spheres and ellipsoids, compared with points on them and with finite differences.
#include "calib/fit/src/ellipsoid.hpp"

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

Ellipsoid true_ellipsoid(MagnitudeShape shape) {
  Ellipsoid truth{.b = Eigen::Vector3d(0.2, -0.1, 0.3)};
  truth.A << 1.1, 0.05, -0.04, 0.0, 0.9, 0.07, 0.0, 0.0, 1.05;
  if (shape == MagnitudeShape::symmetric) {
    truth.A = truth.A.selfadjointView<Eigen::Upper>();
  }
  return truth;
}

// Noisy readings of fields of length 1 in random directions.
EllipsoidCloud cloud_of(
    const Ellipsoid& truth, MagnitudeShape shape, int n, double noise_sd, std::uint64_t seed) {
  RandomStream random(seed);
  EllipsoidCloud cloud{.v = Eigen::MatrixXd(n, 3),
                       .root_weights = Eigen::VectorXd::Ones(n),
                       .noise = Eigen::Matrix3d::Identity(),
                       .shape = shape};
  const Eigen::Matrix3d S = truth.A.inverse();
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d f = random.normals<3>().normalized();
    cloud.v.row(i) = (truth.b + S * f + noise_sd * random.normals<3>()).transpose();
  }
  return cloud;
}

class EllipsoidOfShape : public testing::TestWithParam<MagnitudeShape> {
 protected:
  Ellipsoid truth_ = true_ellipsoid(GetParam());
};

TEST_P(EllipsoidOfShape, IsFoundExactlyWithoutNoise) {
  const EllipsoidCloud cloud = cloud_of(truth_, GetParam(), 12, 0.0, 1);
  const Ellipsoid start = ellipsoid_start(cloud);
  EXPECT_MATRIX_NEAR(start.b, truth_.b, 1e-10);
  EXPECT_MATRIX_NEAR(start.A, truth_.A, 1e-10);
  // A start far away, the sphere, leads to the same ellipsoid.
  const Ellipsoid found = converged_ellipsoid(cloud, sphere_through(cloud), {});
  EXPECT_MATRIX_NEAR(found.b, truth_.b, 1e-12);
  EXPECT_MATRIX_NEAR(found.A, truth_.A, 1e-12);
}

// Each deviation |f| - 1 is divided by its standard deviation (u^T A N A^T u)^1/2.
TEST_P(EllipsoidOfShape, WeighsDeviationsByTheirScatter) {
  EllipsoidCloud cloud = cloud_of(truth_, GetParam(), 15, 0.02, 2);
  cloud.noise << 1.0, 0.2, 0.0, 0.2, 2.0, 0.1, 0.0, 0.1, 0.5;
  cloud.root_weights = Eigen::VectorXd::LinSpaced(15, 0.5, 2.0);
  const Ellipsoid at{.b = Eigen::Vector3d(0.1, 0.0, 0.2), .A = truth_.A};
  const LinearisedEllipsoid linear = linearise_ellipsoid(cloud, at);
  double cost = 0.0;
  for (Eigen::Index i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d f = at.A * (cloud.v.row(i).transpose() - at.b);
    const Eigen::Vector3d u = at.A.transpose() * f.normalized();
    const double scale = cloud.root_weights(i) / std::sqrt(u.dot(cloud.noise * u));
    EXPECT_NEAR(linear.scale(i), scale, 1e-12);
    EXPECT_NEAR(linear.residuals(i), scale * (f.norm() - 1.0), 1e-12);
    cost += std::pow(scale * (f.norm() - 1.0), 2);
  }
  EXPECT_NEAR(ellipsoid_cost(cloud, at, linear.scale), cost, 1e-12 * cost);
}

TEST_P(EllipsoidOfShape, ChangesAsItsJacobianSays) {
  const EllipsoidCloud cloud = cloud_of(truth_, GetParam(), 15, 0.05, 3);
  const LinearisedEllipsoid linear = linearise_ellipsoid(cloud, truth_);
  constexpr double step = 1e-6;
  for (Eigen::Index p = 0; p < ellipsoid_parameters; ++p) {
    const EllipsoidParameters along = step * EllipsoidParameters::Unit(p);
    const Ellipsoid plus = moved_ellipsoid(truth_, along, GetParam());
    const Ellipsoid minus = moved_ellipsoid(truth_, -along, GetParam());
    for (Eigen::Index i = 0; i < cloud.size(); ++i) {
      const Eigen::Vector3d v = cloud.v.row(i).transpose();
      const double change = (plus.A * (v - plus.b)).norm() - (minus.A * (v - minus.b)).norm();
      EXPECT_NEAR(linear.jacobian(i, p), linear.scale(i) * change / (2.0 * step), 1e-8) << p;
    }
  }
}

TEST_P(EllipsoidOfShape, KeepsItsShapeInAStep) {
  EllipsoidParameters step;
  step << 1.0, 2.0, 3.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6;
  const Ellipsoid moved = moved_ellipsoid(truth_, step, GetParam());
  EXPECT_MATRIX_NEAR(moved.b, Eigen::Vector3d(1.2, 1.9, 3.3), 1e-15);
  Eigen::Matrix3d upper = Eigen::Matrix3d::Zero();
  upper << 0.1, 0.2, 0.3, 0.0, 0.4, 0.5, 0.0, 0.0, 0.6;
  const Eigen::Matrix3d change = moved.A - truth_.A;
  EXPECT_MATRIX_NEAR(Eigen::Matrix3d(change.triangularView<Eigen::Upper>()), upper, 1e-15);
  if (GetParam() == MagnitudeShape::symmetric) {
    EXPECT_MATRIX_NEAR(moved.A, Eigen::Matrix3d(moved.A.transpose()), 0.0);
  } else {
    EXPECT_EQ(Eigen::Matrix3d(moved.A.triangularView<Eigen::StrictlyLower>()).norm(), 0.0);
  }
}

// At the solution the gradient of the weighted sum of squares is 0.
TEST_P(EllipsoidOfShape, SolvesTheNormalEquations) {
  const EllipsoidCloud cloud = cloud_of(truth_, GetParam(), 60, 0.01, 4);
  const Ellipsoid found = converged_ellipsoid(cloud, ellipsoid_start(cloud), {});
  const LinearisedEllipsoid linear = linearise_ellipsoid(cloud, found);
  const Eigen::VectorXd gradient = linear.jacobian.transpose() * linear.residuals;
  EXPECT_LT(gradient.norm(), 1e-9 * linear.jacobian.norm() * linear.residuals.norm());
  EXPECT_MATRIX_NEAR(found.b, truth_.b, 0.01);
  EXPECT_MATRIX_NEAR(found.A, truth_.A, 0.03);
  const Ellipsoid again = converged_ellipsoid(cloud, sphere_through(cloud), {});
  EXPECT_MATRIX_NEAR(again.b, found.b, 1e-10);
  EXPECT_MATRIX_NEAR(again.A, found.A, 1e-10);
}

TEST_P(EllipsoidOfShape, DoesNotDependOnTheOrderOfReadings) {
  const EllipsoidCloud cloud = cloud_of(truth_, GetParam(), 30, 0.01, 5);
  EllipsoidCloud reversed = cloud;
  reversed.v = cloud.v.colwise().reverse();
  const Ellipsoid a = converged_ellipsoid(cloud, ellipsoid_start(cloud), {});
  const Ellipsoid b = converged_ellipsoid(reversed, ellipsoid_start(reversed), {});
  EXPECT_MATRIX_NEAR(a.b, b.b, 1e-11);
  EXPECT_MATRIX_NEAR(a.A, b.A, 1e-11);
}

TEST_P(EllipsoidOfShape, LeavesOutReadingsOfRobustWeightZero) {
  const EllipsoidCloud cloud = cloud_of(truth_, GetParam(), 40, 0.01, 6);
  EllipsoidCloud spoiled = cloud;
  Eigen::VectorXd robust = Eigen::VectorXd::Ones(40);
  for (const Eigen::Index wrong : {3, 17}) {
    spoiled.v.row(wrong) *= 1.5;
    robust(wrong) = 0.0;
  }
  EllipsoidCloud rest = cloud;
  rest.root_weights(3) = rest.root_weights(17) = 0.0;
  const Ellipsoid found = converged_ellipsoid(spoiled, ellipsoid_start(cloud), robust);
  const Ellipsoid expected = converged_ellipsoid(rest, ellipsoid_start(cloud), {});
  EXPECT_MATRIX_NEAR(found.b, expected.b, 1e-11);
  EXPECT_MATRIX_NEAR(found.A, expected.A, 1e-11);
}

// The covariance of 200 fits agrees with (J^T J)^-1 times the variance of the noise.
TEST_P(EllipsoidOfShape, ScattersAsItsJacobianSays) {
  constexpr double noise = 2e-3;
  constexpr int trials = 200;
  EllipsoidParameters squares = EllipsoidParameters::Zero();
  for (std::uint64_t seed = 1; seed <= trials; ++seed) {
    const EllipsoidCloud cloud = cloud_of(truth_, GetParam(), 40, noise, seed);
    const Ellipsoid found = converged_ellipsoid(cloud, truth_, {});
    const LinearisedEllipsoid linear = linearise_ellipsoid(cloud, found);
    const Eigen::MatrixXd C =
        noise * noise * (linear.jacobian.transpose() * linear.jacobian).inverse();
    EllipsoidParameters error;
    error.head<3>() = found.b - truth_.b;
    for (std::size_t e = 0; e < ellipsoid_entries.size(); ++e) {
      const auto [i, j] = ellipsoid_entries[e];
      error(3 + static_cast<Eigen::Index>(e)) = found.A(i, j) - truth_.A(i, j);
    }
    squares += error.cwiseAbs2().cwiseQuotient(C.diagonal()) / trials;
  }
  EXPECT_GT(squares.minCoeff(), 0.65);
  EXPECT_LT(squares.maxCoeff(), 1.4);
}

INSTANTIATE_TEST_SUITE_P(Shapes,
                         EllipsoidOfShape,
                         testing::Values(MagnitudeShape::symmetric, MagnitudeShape::triangular),
                         [](const auto& shape) {
                           return shape.param == MagnitudeShape::symmetric ? "symmetric"
                                                                           : "triangular";
                         });

TEST(SphereThrough, FindsCentreAndRadius) {
  const Ellipsoid truth{.b = Eigen::Vector3d(-0.4, 0.1, 0.2),
                        .A = Eigen::Matrix3d::Identity() / 1.7};
  const EllipsoidCloud cloud = cloud_of(truth, MagnitudeShape::symmetric, 6, 0.0, 7);
  const Ellipsoid found = sphere_through(cloud);
  EXPECT_MATRIX_NEAR(found.b, truth.b, 1e-11);
  EXPECT_MATRIX_NEAR(found.A, truth.A, 1e-11);
}

// If all readings are rotated, the centre of the sphere is rotated with them.
TEST(SphereThrough, TurnsWithTheReadings) {
  const EllipsoidCloud cloud =
      cloud_of(true_ellipsoid(MagnitudeShape::symmetric), MagnitudeShape::symmetric, 20, 0.02, 8);
  const Eigen::Matrix3d R = rotation_by(Eigen::Vector3d(0.5, -1.0, 0.7));
  EllipsoidCloud turned = cloud;
  turned.v = cloud.v * R.transpose();
  const Ellipsoid a = sphere_through(cloud);
  const Ellipsoid b = sphere_through(turned);
  EXPECT_MATRIX_NEAR(b.b, R * a.b, 1e-11);
  EXPECT_MATRIX_NEAR(b.A, a.A, 1e-11);
}

// Readings on a hyperboloid have no ellipsoid, so the start is a sphere.
TEST(EllipsoidStart, TakesASphereIfTheQuadricIsNoEllipsoid) {
  RandomStream random(9);
  EllipsoidCloud cloud{.v = Eigen::MatrixXd(30, 3),
                       .root_weights = Eigen::VectorXd::Ones(30),
                       .noise = Eigen::Matrix3d::Identity()};
  for (Eigen::Index i = 0; i < 30; ++i) {
    const double height = 2.0 * random.uniform() - 1.0;
    const double angle = 6.28 * random.uniform();
    const double radius = std::sqrt(1.0 + height * height);
    cloud.v.row(i) << radius * std::cos(angle), radius * std::sin(angle), height;
  }
  const Ellipsoid start = ellipsoid_start(cloud);
  const Ellipsoid sphere = sphere_through(cloud);
  EXPECT_MATRIX_NEAR(start.b, sphere.b, 0.0);
  EXPECT_MATRIX_NEAR(start.A, sphere.A, 0.0);
  EXPECT_NEAR(start.A(0, 0), start.A(2, 2), 1e-15);
}

// A triangular A and its symmetric counterpart describe the same quadric. They differ by a
// rotation.
TEST(EllipsoidStart, GivesOneQuadricInBothShapes) {
  const Ellipsoid truth = true_ellipsoid(MagnitudeShape::triangular);
  EllipsoidCloud cloud = cloud_of(truth, MagnitudeShape::triangular, 25, 0.01, 10);
  const Ellipsoid triangular = ellipsoid_start(cloud);
  cloud.shape = MagnitudeShape::symmetric;
  const Ellipsoid symmetric = ellipsoid_start(cloud);
  EXPECT_MATRIX_NEAR(triangular.b, symmetric.b, 1e-12);
  EXPECT_MATRIX_NEAR(Eigen::Matrix3d(triangular.A.transpose() * triangular.A),
                     Eigen::Matrix3d(symmetric.A.transpose() * symmetric.A), 1e-12);
  EXPECT_TRUE(is_rotation(symmetric.A * triangular.A.inverse(), 1e-9));
}

}  // namespace
}  // namespace axiscal
