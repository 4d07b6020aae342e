// SPDX-License-Identifier: Apache-2.0
// The F test of the columns f_k^2, compared with least squares of all rows together.
#include "calib/fit/src/curvature.hpp"

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "axiscal/calib/distributions.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

constexpr double bend_noise = 1e-3;

// Columns and readings of an axis, projected off the axis's own columns.
struct ProjectedAxis {
  Eigen::MatrixXd columns;  // shared columns, then f_k^2
  Eigen::VectorXd y;
};

std::vector<ProjectedAxis> projected_axes(Eigen::Index shared, std::uint64_t seed) {
  RandomStream random(seed);
  std::vector<ProjectedAxis> axes(3);
  for (ProjectedAxis& axis : axes) {
    axis.columns.resize(15, shared + 1);
    axis.y.resize(15);
    for (double& value : axis.columns.reshaped()) {
      value = random.normal();
    }
    for (double& value : axis.y) {
      value = random.normal();
    }
  }
  return axes;
}

IndependentCurvature bent_axes_of(const std::vector<ProjectedAxis>& axes, Eigen::Index errors) {
  IndependentCurvature bent(errors);
  for (const ProjectedAxis& axis : axes) {
    bent.add(axis.columns, axis.y, axis.columns.colwise().squaredNorm().transpose());
  }
  return bent;
}

// Least squares of the rows of all axes, divided by their sigma. Each error of an input adds a row
// with a 1.
CurvatureFit bend_by_all_rows(const std::vector<ProjectedAxis>& axes,
                              Eigen::Index errors,
                              const Eigen::VectorXd& variances,
                              bool bent) {
  const Eigen::Index shared = axes.front().columns.cols() - 1;
  const Eigen::Index columns = shared + (bent ? 3 : 0);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(45 + errors, columns);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(45 + errors);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const ProjectedAxis& axis = axes[static_cast<std::size_t>(k)];
    const double sigma = std::sqrt(variances(k));
    A.block(15 * k, 0, 15, shared) = axis.columns.leftCols(shared) / sigma;
    if (bent) {
      A.block(15 * k, shared + k, 15, 1) = axis.columns.rightCols<1>() / sigma;
    }
    y.segment(15 * k, 15) = axis.y / sigma;
  }
  for (Eigen::Index e = 0; e < errors; ++e) {
    A(45 + e, shared - errors + e) = 1.0;
  }
  const Eigen::VectorXd b =
      columns > 0 ? Eigen::VectorXd(A.householderQr().solve(y)) : Eigen::VectorXd();
  const Eigen::VectorXd left = columns > 0 ? Eigen::VectorXd(y - A * b) : y;
  CurvatureFit bend{.estimate = Eigen::VectorXd::Zero(3),
                    .squares = left.squaredNorm(),
                    .squares_of_axis = Eigen::VectorXd(3)};
  for (Eigen::Index k = 0; k < 3; ++k) {
    bend.squares_of_axis(k) = variances(k) * left.segment(15 * k, 15).squaredNorm();
    bend.estimate(k) = bent ? b(shared + k) : 0.0;
  }
  return bend;
}

// Without shared columns and with them. Some of them are errors of inputs.
TEST(IndependentCurvature, AgreeWithLeastSquaresOfAllRows) {
  const Eigen::Vector3d variances(1.0, 4.0, 0.25);
  for (const Eigen::Index shared : {0, 2, 5}) {
    for (const Eigen::Index errors : {Eigen::Index{0}, std::min<Eigen::Index>(shared, 3)}) {
      const std::vector<ProjectedAxis> axes = projected_axes(shared, 1);
      const IndependentCurvature bent_axes = bent_axes_of(axes, errors);
      for (const bool bent : {true, false}) {
        const auto found = bent_axes.fit(variances, bent);
        ASSERT_TRUE(found.has_value());
        const CurvatureFit expected = bend_by_all_rows(axes, errors, variances, bent);
        EXPECT_MATRIX_NEAR(found->estimate, expected.estimate, 1e-10);
        EXPECT_MATRIX_NEAR(found->squares_of_axis, expected.squares_of_axis, 1e-9);
        EXPECT_NEAR(found->squares, expected.squares, 1e-9);
      }
    }
  }
}

TEST(IndependentCurvature, HaveNoFitForAColumnOfZeros) {
  std::vector<ProjectedAxis> axes = projected_axes(1, 2);
  axes[1].columns.col(1).setZero();
  const IndependentCurvature bent = bent_axes_of(axes, 0);
  EXPECT_FALSE(bent.fit(Eigen::Vector3d::Ones(), true).has_value());
  EXPECT_TRUE(bent.fit(Eigen::Vector3d::Ones(), false).has_value());
}

// If the axis's own coefficients explain a column, only rounding errors remain of it, and there is
// no fit.
TEST(IndependentCurvature, HaveNoFitForAColumnThatIsTakenUp) {
  const std::vector<ProjectedAxis> axes = projected_axes(1, 3);
  IndependentCurvature bent(0);
  for (const ProjectedAxis& axis : axes) {
    Eigen::MatrixXd rest = axis.columns;
    rest.col(1) *= 1e-9;
    bent.add(rest, axis.y, axis.columns.colwise().squaredNorm().transpose());
  }
  EXPECT_FALSE(bent.fit(Eigen::Vector3d::Ones(), true).has_value());
}

// A labelled run with a known field. The unknowns of each axis are b, S and the coefficient of
// f_k^2.
class BendOfRun {
 public:
  explicit BendOfRun(ReadingSet set)
      : set_(std::move(set)), layings_(average_layings(set_, {})), bent_(0) {
    const Eigen::MatrixXd X = test::rows_of(set_, test::sloping_gravity);
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Eigen::VectorXd square = X.col(k + 1).cwiseAbs2();
      Eigen::MatrixXd with(X.rows(), 5);
      with << X, square;
      const Eigen::VectorXd y = set_.response.col(k);
      const Eigen::VectorXd left = y - X * X.householderQr().solve(y);
      const Eigen::VectorXd b = with.householderQr().solve(y);
      straight_(k) = left.squaredNorm();
      bent_squares_(k) = (y - with * b).squaredNorm();
      bends_(k) = b(4);
      bent_.add(square - X * X.householderQr().solve(square), left,
                Eigen::VectorXd::Constant(1, square.squaredNorm()));
    }
  }

  [[nodiscard]] CurvatureFTest test() const {
    const double free = static_cast<double>(set_.size()) - 4.0;
    return {layings_, false, 12, straight_ / free};
  }

  [[nodiscard]] std::optional<CurvatureTest> result(CurvatureFTest& test, double F = 1.0) const {
    return test.by([&](bool bent) { return bent_.fit(test.variances(), bent); }, F);
  }

  // By QR of each axis: sums of squares without f_k^2, sums of squares with it, and its
  // coefficients.
  [[nodiscard]] const Eigen::Vector3d& straight() const { return straight_; }
  [[nodiscard]] const Eigen::Vector3d& bent() const { return bent_squares_; }
  [[nodiscard]] const Eigen::Vector3d& bends() const { return bends_; }

 private:
  ReadingSet set_;
  MeanReadings layings_;
  IndependentCurvature bent_;
  Eigen::Vector3d straight_;
  Eigen::Vector3d bent_squares_;
  Eigen::Vector3d bends_;
};

ReadingSet set_to_bend(std::uint64_t seed,
                       const Eigen::Vector3d& noise_of_axes,
                       double bend = 0.0) {
  ReadingSet set =
      test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                         standard_design(24), 0.0, seed);
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  RandomStream random(seed);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      set.response(i, k) += noise_of_axes(k) * random.normal() + bend * X(i, k + 1) * X(i, k + 1);
    }
  }
  return set;
}

// The axes have equal noise, so the test is a textbook's F test with 3 and 57 degrees of freedom.
TEST(CurvatureFTest, PoolsAxesThatScatterAlike) {
  const BendOfRun run(set_to_bend(4, Eigen::Vector3d::Constant(bend_noise), 1.5e-3));
  CurvatureFTest test = run.test();
  const auto result = run.result(test, 3.0);
  ASSERT_TRUE(result.has_value());
  const double drop = (run.straight() - run.bent()).sum();
  const double f = (drop / 3.0) / (run.bent().sum() / 57.0);
  EXPECT_NEAR(result->p_value, f_upper_p(f, 3.0, 57.0), 1e-9);
  EXPECT_MATRIX_NEAR(result->bends, 9.0 * run.bends(), 1e-9);
  EXPECT_MATRIX_NEAR(test.variances(), Eigen::Vector3d::Constant(run.bent().sum() / 57.0), 1e-15);
}

TEST(CurvatureFTest, WeighsAxesThatScatterDifferently) {
  const BendOfRun run(set_to_bend(5, bend_noise * Eigen::Vector3d(1.0, 10.0, 0.1)));
  CurvatureFTest test = run.test();
  const Eigen::VectorXd before = test.variances();
  const auto result = run.result(test);
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(test.variances(), before);
  const Eigen::Vector3d drops =
      (run.straight() - run.bent()).cwiseQuotient(Eigen::Vector3d(before));
  // Without the columns the weighted sum of squares of each axis equals its degrees of freedom, 20.
  const double left = 60.0 - drops.sum();
  EXPECT_NEAR(result->p_value, f_upper_p((drops.sum() / 3.0) / (left / 57.0), 3.0, 57.0), 1e-9);
}

TEST(CurvatureFTest, TakesTheStatedRatioOfTheNoise) {
  ReadingSet set = set_to_bend(6, bend_noise * Eigen::Vector3d(1.0, 10.0, 0.1));
  set.noise_ratio = Eigen::Vector3d(1.0, 10.0, 0.1);
  const BendOfRun run(set);
  CurvatureFTest test = run.test();
  ASSERT_TRUE(run.result(test).has_value());
  EXPECT_NEAR(test.variances()(1) / test.variances()(0), 100.0, 1e-9);
  EXPECT_NEAR(test.variances()(2) / test.variances()(0), 0.01, 1e-12);
  EXPECT_NEAR(std::sqrt(test.variances()(0)) / bend_noise, 1.0, 0.3);
}

TEST(CurvatureFTest, CountsTheScatterWithinLayings) {
  ReadingSet set = set_to_bend(7, Eigen::Vector3d::Constant(bend_noise));
  for (std::size_t i = 1; i < 24; i += 2) {  // each laying has two readings
    set.readings[i].point = set.readings[i - 1].point;
  }
  Rotations rotations;
  for (const Reading& reading : set.readings) {
    rotations.push_back(set.orientation(*reading.point));
  }
  set.rotation_sensor_from_table = rotations;
  const MeanReadings layings = average_layings(set, {});
  ASSERT_EQ(layings.set().size(), 12);
  EXPECT_EQ(layings.degrees_of_freedom, Eigen::Vector3d::Constant(12.0));
  CurvatureFTest test(layings, true, 14, Eigen::Vector3d(1.0, 2.0, 4.0));
  CurvatureFit bend{.estimate = Eigen::Vector3d::Ones(),
                    .squares = 0.0,
                    .squares_of_axis = Eigen::Vector3d::Constant(1e-6)};
  const auto result = test.by(
      [&](bool bent) {
        bend.squares = bent ? 10.0 : 16.0;
        return std::optional(bend);
      },
      1.0);
  ASSERT_TRUE(result.has_value());
  // 72 values less 14 columns and three coefficients of f_k^2.
  double left = 10.0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    left += layings.squares(k) / test.variances()(k);
  }
  EXPECT_NEAR(result->p_value, f_upper_p((6.0 / 3.0) / (left / 55.0), 3.0, 55.0), 1e-12);
}

TEST(CurvatureFTest, HasNoAnswerWithoutAFitOrFreedom) {
  const ReadingSet set = set_to_bend(8, Eigen::Vector3d::Constant(bend_noise));
  const MeanReadings layings = average_layings(set, {});
  const CurvatureFit bend{.estimate = Eigen::Vector3d::Zero(),
                          .squares = 1.0,
                          .squares_of_axis = Eigen::Vector3d::Ones()};
  CurvatureFTest test(layings, false, 12, Eigen::Vector3d::Ones());
  EXPECT_FALSE(test.by([](bool) { return std::optional<CurvatureFit>(); }, 1.0).has_value());
  EXPECT_FALSE(test.by([&](bool bent) { return bent ? std::optional(bend) : std::nullopt; }, 1.0)
                   .has_value());
  CurvatureFTest full(layings, false, 69, Eigen::Vector3d::Ones());  // 69 + 3 unknowns of 72 values
  EXPECT_FALSE(full.by([&](bool) { return std::optional(bend); }, 1.0).has_value());
}

TEST(CurvatureFTest, SeesABendOfAFewSigma) {
  int seen = 0;
  for (std::uint64_t seed = 50; seed < 70; ++seed) {
    const BendOfRun run(set_to_bend(seed, Eigen::Vector3d::Constant(bend_noise), 5.0 * bend_noise));
    CurvatureFTest test = run.test();
    seen += run.result(test)->p_value < 0.005 ? 1 : 0;
  }
  EXPECT_EQ(seen, 20);
}

TEST(CurvatureFTest, IsRightAboutStraightAxes) {
  constexpr int trials = 400;
  for (const double ratio : {1.0, 5.0}) {
    int below = 0;
    for (int trial = 0; trial < trials; ++trial) {
      const BendOfRun run(set_to_bend(static_cast<std::uint64_t>(2000 + trial),
                                      bend_noise * Eigen::Vector3d(1.0, ratio, 1.0)));
      CurvatureFTest test = run.test();
      below += run.result(test)->p_value < 0.05 ? 1 : 0;
    }
    EXPECT_GE(below, 6) << ratio;
    EXPECT_LE(below, 38) << ratio;
  }
}

}  // namespace
}  // namespace axiscal
