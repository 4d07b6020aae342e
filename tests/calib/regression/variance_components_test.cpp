// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/variance_components.hpp"

#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "axiscal/core/random.hpp"
#include "calib/regression/piecewise_columns.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

// Units of two rows. Each row has its own noise, and a turn of sd `tau` changes both rows of a
// unit.
VarianceProblem problem_of(Eigen::Index units, double sigma, double tau, RandomStream& random) {
  VarianceProblem problem{.rows = 2,
                          .W = Eigen::MatrixXd(2 * units, 3),
                          .y = Eigen::VectorXd(2 * units),
                          .roots = std::vector<Eigen::MatrixXd>(3, Eigen::MatrixXd(2 * units, 1))};
  for (Eigen::Index i = 0; i < units; ++i) {
    const Eigen::Vector2d along = random.normals<2>();
    const Eigen::Vector2d noise = sigma * random.normals<2>();
    const double turn = tau * random.normal();
    for (Eigen::Index k = 0; k < 2; ++k) {
      problem.W.row(2 * i + k) << 1.0, random.normal(), random.normal();
      problem.y(2 * i + k) = (k == 0 ? 1.0 : 2.0) * noise(k) + turn * along(k);
    }
    problem.roots[0].middleRows<2>(2 * i) << 1.0, 0.0;
    problem.roots[1].middleRows<2>(2 * i) << 0.0, 1.0;
    problem.roots[2].middleRows<2>(2 * i) = along;
  }
  return problem;
}

// -2 ln of the restricted likelihood with dense matrices for the variances `theta`.
double misfit(const VarianceProblem& problem, const Eigen::VectorXd& theta) {
  const Eigen::Index n = problem.y.size();
  Eigen::MatrixXd V = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t q = 0; q < 3; ++q) {
    for (Eigen::Index at = 0; at < n; at += 2) {
      const Eigen::MatrixXd K = problem.roots[q].middleRows<2>(at);
      V.block<2, 2>(at, at) += theta(static_cast<Eigen::Index>(q)) * K * K.transpose();
    }
  }
  const Eigen::MatrixXd inverse = V.inverse();
  const Eigen::MatrixXd N = problem.W.transpose() * inverse * problem.W;
  const Eigen::VectorXd b = N.inverse() * (problem.W.transpose() * inverse * problem.y);
  const Eigen::VectorXd r = problem.y - problem.W * b;
  return std::log(V.determinant()) + std::log(N.determinant()) + r.dot(inverse * r);
}

TEST(VarianceComponents, MaximisesTheRestrictedLikelihood) {
  RandomStream random(2);
  const VarianceProblem problem = problem_of(20, 1.0, 2.0, random);
  const auto fit = fit_variance_components(problem, Eigen::Vector3d(1.0, 1.0, 1.0));
  ASSERT_TRUE(fit);
  const double best = misfit(problem, fit->theta);
  for (Eigen::Index q = 0; q < 3; ++q) {
    for (const double factor : {0.97, 1.03}) {
      Eigen::VectorXd beside = fit->theta;
      beside(q) *= factor;
      EXPECT_GT(misfit(problem, beside), best) << q << " " << factor;
    }
  }
  EXPECT_MATRIX_NEAR(fit->scatter(), fit->covariance, 1e-8);
}

// Each row has a bias, changes of the bias between blocks, and two more columns. The last column is
// shared by all rows. Some rows are left out.
VarianceProblem problem_in_blocks(RandomStream& random) {
  constexpr Eigen::Index units = 40;
  constexpr Eigen::Index of_block = 10;
  VarianceProblem problem = problem_of(units, 1.0, 2.0, random);
  problem.W = Eigen::MatrixXd::Zero(2 * units, 13);
  Eigen::Matrix<double, 4, 3> changes;
  changes << 1, 1, 1, -1, 1, -1, 1, -1, -1, -1, -1, 1;
  for (Eigen::Index row = 0; row < 2 * units; ++row) {
    problem.W.row(row).segment<6>(row % 2 * 6) << 1.0, random.normal(), random.normal(),
        changes.row(row / 2 / of_block);
    problem.W(row, 12) = random.normal();
  }
  for (const Eigen::Index row : {3, 44}) {
    problem.W.row(row).setZero();
    problem.y(row) = 0.0;
    for (Eigen::MatrixXd& K : problem.roots) {
      K.row(row).setZero();
    }
  }
  return problem;
}

TEST(VarianceComponents, AreTheSameInAnyBasisOfTheColumns) {
  RandomStream random(11);
  const VarianceProblem problem = problem_in_blocks(random);
  VarianceProblem mixed = problem;
  Eigen::MatrixXd T = Eigen::MatrixXd::Identity(13, 13);
  for (double& entry : T.reshaped()) {
    entry += 0.2 * random.normal();
  }
  mixed.W = problem.W * T;  // every column affects both rows
  const auto fit = fit_variance_components(problem, Eigen::Vector3d(1.0, 1.0, 1.0));
  const auto other = fit_variance_components(mixed, Eigen::Vector3d(1.0, 1.0, 1.0));
  ASSERT_TRUE(fit && other);
  EXPECT_MATRIX_NEAR(fit->theta, other->theta, 1e-8);
  EXPECT_MATRIX_NEAR(fit->estimate, T * other->estimate, 1e-8);
  EXPECT_MATRIX_NEAR(fit->covariance, T * other->covariance * T.transpose(), 1e-8);
  for (std::size_t q = 0; q < 3; ++q) {
    EXPECT_MATRIX_NEAR(fit->unit_shares[q], T * other->unit_shares[q] * T.transpose(), 1e-8);
  }
  const auto weighted = fit_at_variances(problem, fit->theta);
  ASSERT_TRUE(weighted);
  EXPECT_MATRIX_NEAR(weighted->estimate, fit->estimate, 1e-8);
}

TEST(PiecewiseColumns, GiveEachBlockAColumn) {
  RandomStream random(12);
  const VarianceProblem problem = problem_in_blocks(random);
  const PiecewiseColumns columns = piecewise_columns(problem.W, problem.rows, 0);
  ASSERT_EQ(columns.pieces.size(), 4U);
  Eigen::VectorXd in_basis(columns.count);
  for (double& entry : in_basis) {
    entry = random.normal();
  }
  const Eigen::VectorXd b = columns.estimate_of(in_basis);
  for (const ColumnPiece& piece : columns.pieces) {
    EXPECT_EQ(piece.columns.size(), 7U);  // 2 x (a block + 2 own), 1 shared
    const Eigen::VectorXd by_piece = piece.W * in_basis(piece.columns);
    const Eigen::VectorXd by_all = problem.W.middleRows(piece.first, piece.W.rows()) * b;
    EXPECT_MATRIX_NEAR(by_piece, by_all, 1e-12);
  }
}

TEST(PiecewiseColumns, StayWhereTheyTellFewerBlocksApart) {
  RandomStream random(13);
  const VarianceProblem problem = problem_in_blocks(random);
  // The bias and two of the three changes do not span all differences between four blocks.
  const Eigen::MatrixXd W = problem.W.leftCols(5);
  const PiecewiseColumns columns = piecewise_columns(W, problem.rows, 0);
  EXPECT_TRUE(columns.replaced.empty());
  ASSERT_EQ(columns.pieces.size(), 1U);
  EXPECT_MATRIX_NEAR(columns.pieces.front().W, W, 0.0);
}

TEST(VarianceComponents, AreRightInTheMean) {
  RandomStream random(5);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  constexpr int runs = 300;
  for (int run = 0; run < runs; ++run) {
    const VarianceProblem problem = problem_of(40, 1.0, 2.0, random);
    const auto fit = fit_variance_components(problem, Eigen::Vector3d(1.0, 1.0, 1.0));
    ASSERT_TRUE(fit);
    sum += fit->theta / runs;
  }
  EXPECT_NEAR(sum(0), 1.0, 0.1);
  EXPECT_NEAR(sum(1), 4.0, 0.4);
  EXPECT_NEAR(sum(2), 4.0, 0.4);
}

TEST(VarianceComponents, SetsToZeroWhatIsNotThere) {
  RandomStream random(6);
  int zeros = 0;
  for (int run = 0; run < 100; ++run) {
    const auto fit =
        fit_variance_components(problem_of(20, 1.0, 0.0, random), Eigen::Vector3d(1.0, 1.0, 1.0));
    ASSERT_TRUE(fit);
    EXPECT_GE(fit->theta.minCoeff(), 0.0);
    zeros += fit->theta(2) == 0.0 ? 1 : 0;
  }
  EXPECT_GT(zeros, 30);
  EXPECT_LT(zeros, 80);
}

// Errors with a prior are an additional variance, V + H H^T.
TEST(VarianceComponents, TakesColumnsWithAPriorAsErrors) {
  RandomStream random(8);
  VarianceProblem problem = problem_of(20, 1.0, 0.0, random);
  problem.roots.resize(2);
  problem.prior = 1;
  const Eigen::Vector2d theta(1.0, 4.0);
  const auto fit = fit_variance_components(problem, theta);
  ASSERT_TRUE(fit);
  const Eigen::Index n = problem.y.size();
  Eigen::MatrixXd V = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    V(i, i) = fit->theta(i % 2);
  }
  const Eigen::VectorXd H = problem.W.col(2);
  const Eigen::MatrixXd inverse = (V + H * H.transpose()).inverse();
  const Eigen::MatrixXd X = problem.W.leftCols<2>();
  const Eigen::MatrixXd C = (X.transpose() * inverse * X).inverse();
  EXPECT_MATRIX_NEAR(fit->covariance.topLeftCorner(2, 2), C, 1e-10);
  EXPECT_MATRIX_NEAR(fit->estimate.head(2), C * (X.transpose() * inverse * problem.y), 1e-9);
}

// The score step and its standard error agree with dense matrices: A theta = g, A_qr = tr(P Q_q P
// Q_r).
TEST(VarianceComponents, ScoreIsOneStepFromNothing) {
  RandomStream random(11);
  const VarianceProblem problem = problem_of(20, 1.0, 3.0, random);
  const Eigen::Vector3d theta(1.0, 4.0, 0.0);
  const Eigen::Index n = problem.y.size();
  std::vector<Eigen::MatrixXd> Q;
  Eigen::MatrixXd V = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t q = 0; q < 3; ++q) {
    Eigen::MatrixXd& own = Q.emplace_back(Eigen::MatrixXd::Zero(n, n));
    for (Eigen::Index at = 0; at < n; at += 2) {
      const Eigen::MatrixXd K = problem.roots[q].middleRows<2>(at);
      own.block<2, 2>(at, at) = K * K.transpose();
    }
    V += theta(static_cast<Eigen::Index>(q)) * own;
  }
  const Eigen::MatrixXd inverse = V.inverse();
  const Eigen::MatrixXd P = inverse - inverse * problem.W *
                                          (problem.W.transpose() * inverse * problem.W).inverse() *
                                          problem.W.transpose() * inverse;
  Eigen::Matrix3d A;
  Eigen::Vector3d g;
  for (Eigen::Index q = 0; q < 3; ++q) {
    const Eigen::MatrixXd PQ = P * Q[static_cast<std::size_t>(q)];
    g(q) = problem.y.dot(PQ * P * problem.y);
    for (Eigen::Index r = 0; r < 3; ++r) {
      A(q, r) = (PQ * P * Q[static_cast<std::size_t>(r)]).trace();
    }
  }
  const Eigen::Matrix3d C = A.inverse();
  const std::optional<double> score = component_score(problem, theta, 2);
  ASSERT_TRUE(score);
  EXPECT_NEAR(*score, (C * g)(2) / std::sqrt(2.0 * C(2, 2)), 1e-9);
  EXPECT_GT(*score, 1.0);
}

TEST(VarianceComponents, RefusesColumnsThatAreNotDetermined) {
  RandomStream random(10);
  VarianceProblem problem = problem_of(20, 1.0, 1.0, random);
  problem.W.col(2) = problem.W.col(1);
  EXPECT_FALSE(fit_variance_components(problem, Eigen::Vector3d(1.0, 1.0, 1.0)));
}

}  // namespace
}  // namespace axiscal
