// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/factor.hpp"

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "axiscal/core/random.hpp"

namespace axiscal {
namespace {

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index cols, std::uint64_t seed) {
  RandomStream random(seed);
  Eigen::MatrixXd A(rows, cols);
  for (double& entry : A.reshaped()) {
    entry = random.normal();
  }
  return A;
}

// Columns whose sizes differ by 13 orders of magnitude.
Eigen::MatrixXd badly_scaled(Eigen::Index rows, std::uint64_t seed) {
  return random_matrix(rows, 3, seed) * Eigen::Vector3d(1e-6, 1.0, 1e7).asDiagonal();
}

TEST(Factor, SolvesColumnsOfAnySize) {
  const Eigen::MatrixXd J = badly_scaled(9, 1);
  const Eigen::Vector3d x(2e5, -1.0, 3e-7);
  const Factor factor(J);
  ASSERT_TRUE(factor.has_full_rank());
  EXPECT_EQ(factor.rank(), 3);
  EXPECT_TRUE(factor.solve(J * x).isApprox(x, 1e-12));
  const Eigen::MatrixXd T = factor.root_of_covariance();
  EXPECT_TRUE(((J * T).transpose() * (J * T)).isIdentity(1e-12));
  const Eigen::Vector3d sizes(1e-6, 1.0, 1e7);
  const Eigen::Matrix3d N =
      sizes.cwiseInverse().asDiagonal() * (J.transpose() * J) * sizes.cwiseInverse().asDiagonal();
  const Eigen::Matrix3d C = sizes.asDiagonal() * factor.covariance() * sizes.asDiagonal();
  EXPECT_TRUE(C.isApprox(N.inverse(), 1e-10));
}

TEST(Factor, HasTheLeverageOfTheHatMatrix) {
  const Eigen::MatrixXd J = random_matrix(7, 3, 2);
  const Eigen::MatrixXd hat = J * (J.transpose() * J).inverse() * J.transpose();
  EXPECT_TRUE(Factor(J).leverage().isApprox(hat.diagonal(), 1e-12));
}

TEST(Factor, CountsNearlyDependentColumnsByItsThreshold) {
  Eigen::MatrixXd J = random_matrix(8, 3, 3);
  J.col(2) = J.col(0) + 1e-9 * J.col(2);
  EXPECT_TRUE(Factor(J).has_full_rank());
  EXPECT_FALSE(Factor(J, 1e-7).has_full_rank());
  EXPECT_EQ(Factor(J, 1e-7).rank(), 2);
}

TEST(PositiveFactor, InvertsWhateverTheUnits) {
  const Eigen::MatrixXd J = badly_scaled(9, 4);
  const PositiveFactor factor(J.transpose() * J);
  ASSERT_TRUE(factor.is_determined(1e-12));
  const Eigen::MatrixXd root = factor.root_of_inverse();
  EXPECT_TRUE(((J * root).transpose() * (J * root)).isIdentity(1e-9));
  const Eigen::Vector3d right = J.transpose() * Eigen::VectorXd::Ones(9);
  EXPECT_TRUE(factor.solve(right).isApprox(Factor(J).solve(Eigen::VectorXd::Ones(9)), 1e-8));
}

TEST(PositiveFactor, HasTheDeterminant) {
  const Eigen::MatrixXd J = random_matrix(6, 3, 5);
  const Eigen::MatrixXd N = J.transpose() * J;
  EXPECT_NEAR(PositiveFactor(N).log_determinant(), std::log(N.determinant()), 1e-12);
}

TEST(PositiveFactor, RefusesWhatIsNotPositive) {
  Eigen::MatrixXd J = random_matrix(6, 3, 6);
  J.col(2) = J.col(0);
  EXPECT_FALSE(PositiveFactor(J.transpose() * J).is_determined(1e-10));
  EXPECT_FALSE(PositiveFactor(-Eigen::Matrix2d::Identity()).is_determined());
  EXPECT_FALSE(PositiveFactor(Eigen::Matrix2d::Constant(std::nan(""))).is_determined());
}

TEST(Whitening, MakesErrorsIndependent) {
  const Eigen::MatrixXd J = random_matrix(5, 5, 7);
  const Eigen::MatrixXd V = J * J.transpose();
  const Whitening whitening(V);
  ASSERT_TRUE(whitening.is_valid());
  EXPECT_TRUE((whitening.times(J) * whitening.times(J).transpose()).isIdentity(1e-9));
  EXPECT_TRUE((whitening.root() * whitening.root().transpose()).isApprox(V, 1e-12));
  EXPECT_TRUE(whitening.transposed_times(whitening.times(V)).isIdentity(1e-8));
  EXPECT_FALSE(Whitening(-V).is_valid());
}

TEST(SymmetricEigen, OrdersAscending) {
  Eigen::Matrix3d A;
  A << 2.0, 1.0, 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, -5.0;
  const SymmetricEigen eigen = symmetric_eigen(A);
  EXPECT_TRUE(eigen.values.isApprox(Eigen::Vector3d(-5.0, 1.0, 3.0), 1e-12));
  EXPECT_TRUE(
      (eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose()).isApprox(A, 1e-12));
}

TEST(SingularValues, GiveTheMatrixBack) {
  for (const auto& A : {random_matrix(6, 3, 8), random_matrix(3, 6, 9)}) {
    const SingularValues svd = singular_values(A);
    EXPECT_EQ(svd.values.size(), 3);
    EXPECT_GE(svd.values(0), svd.values(2));
    EXPECT_TRUE((svd.U * svd.values.asDiagonal() * svd.V.transpose()).isApprox(A, 1e-12));
  }
}

TEST(InverseOf, IsThatOfEachSize) {
  for (const Eigen::Index size : {1, 2, 3, 4, 7}) {
    const Eigen::MatrixXd A = random_matrix(size, size, 10 + static_cast<std::uint64_t>(size));
    EXPECT_TRUE((inverse_of(A) * A).isIdentity(1e-9)) << size;
  }
}

TEST(SolveSymmetric, TakesASemiDefiniteMatrix) {
  const Eigen::MatrixXd J = random_matrix(4, 2, 12);
  const Eigen::MatrixXd A = J * J.transpose();  // 4 x 4, rank 2
  const Eigen::VectorXd b = A * Eigen::Vector4d(1.0, 2.0, 3.0, 4.0);
  EXPECT_TRUE((A * solve_symmetric(A, b)).isApprox(b, 1e-8));
  EXPECT_TRUE(is_semi_definite(A + 1e-12 * Eigen::Matrix4d::Identity()));
  EXPECT_FALSE(is_semi_definite(-Eigen::Matrix2d::Identity()));
}

TEST(CovarianceRoot, TakesAnyRank) {
  const Eigen::MatrixXd J = random_matrix(4, 2, 13);
  const Eigen::MatrixXd C = J * J.transpose();
  const Eigen::MatrixXd L = covariance_root(C);
  EXPECT_TRUE((L * L.transpose()).isApprox(C, 1e-10));
}

TEST(PseudoInverseWithRank, IsTheMoorePenroseInverse) {
  Eigen::MatrixXd A = random_matrix(5, 3, 14);
  A.col(2) = A.col(0) + A.col(1);
  const auto [inverse, rank] = pseudo_inverse_with_rank(A);
  EXPECT_EQ(rank, 2);
  EXPECT_TRUE((A * inverse * A).isApprox(A, 1e-10));
  EXPECT_TRUE((inverse * A * inverse).isApprox(inverse, 1e-10));
  EXPECT_TRUE((A * inverse).isApprox((A * inverse).transpose(), 1e-10));
  EXPECT_TRUE(pseudo_inverse(A).isApprox(inverse, 1e-12));
  const Eigen::VectorXd b = random_matrix(5, 1, 15);
  EXPECT_TRUE(minimum_norm_solution(A, b).isApprox(inverse * b, 1e-9));
}

TEST(RootOfPseudoInverse, LeavesOpenDirectionsOut) {
  Eigen::MatrixXd A = random_matrix(6, 2, 16);
  A.col(1) = 1e-12 * A.col(1) + A.col(0);
  EXPECT_EQ(root_of_pseudo_inverse(A, 1e-9).cols(), 1);
  EXPECT_EQ(root_of_pseudo_inverse(A, 1e-14).cols(), 2);
}

TEST(OrthonormalBasis, AndItsComplementSpanAll) {
  const Eigen::MatrixXd A = random_matrix(6, 2, 17);
  Eigen::MatrixXd both(6, 6);
  both << orthonormal_basis(A), orthogonal_complement(A);
  EXPECT_TRUE((both.transpose() * both).isIdentity(1e-12));
  EXPECT_LT((orthogonal_complement(A).transpose() * A).norm(), 1e-12);
}

TEST(ConfoundedColumns, AreNamedOnce) {
  Eigen::MatrixXd J = random_matrix(8, 4, 18);
  J.col(3) = 2.0 * J.col(1);
  const std::vector<Eigen::Index> open = confounded_columns(J, 1e-9, 1e-6);
  EXPECT_EQ(open, (std::vector<Eigen::Index>{1, 3}));
  EXPECT_EQ(undetermined_column_names(open, {"a", "b", "c", "b"}), std::vector<std::string>{"b"});
  EXPECT_TRUE(confounded_columns(random_matrix(8, 4, 19), 1e-9, 1e-6).empty());
}

TEST(ConditionOf, AgreesWithTheNormalEquations) {
  const Eigen::MatrixXd J = badly_scaled(12, 20);
  const std::optional<double> small = condition_from_normal_matrix(J.transpose() * J);
  ASSERT_TRUE(small.has_value());
  EXPECT_NEAR(*small, condition_of(J), 1e-6 * *small);
  Eigen::MatrixXd close = random_matrix(12, 2, 21);
  close.col(1) = close.col(0) + 1e-4 * close.col(1);
  EXPECT_FALSE(condition_from_normal_matrix(close.transpose() * close).has_value());
  EXPECT_GT(condition_of(close), 1e3);
}

}  // namespace
}  // namespace axiscal
