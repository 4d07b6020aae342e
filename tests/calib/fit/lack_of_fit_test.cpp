// SPDX-License-Identifier: Apache-2.0
// The test of lack of fit by the means of poses, if readings share errors of inputs.
#include "calib/fit/lack_of_fit.hpp"

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/fit/input_quantities.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

constexpr double pose_noise = 2e-4;
constexpr int times_each = 3;

// The 12 standard points, repeated `times` times as a whole.
std::vector<DesignEntry> repeated_design(int times = times_each) {
  std::vector<DesignEntry> all;
  for (int t = 0; t < times; ++t) {
    for (const DesignEntry& entry : standard_design(12)) {
      all.push_back(entry);
    }
  }
  return all;
}

// Readings on a table that slopes as `in_table` states. The stated field is level.
ReadingSet repeated_poses(const Eigen::Vector3d& in_table, std::uint64_t seed) {
  ReadingSet set = test::labelled_set(test::some_response(), test::gravity_in_table(in_table),
                                      repeated_design(), pose_noise, seed);
  set.field = test::gravity_in_table(Eigen::Vector3d::UnitZ());
  return set;
}

Experiment experiment_of_slope(double u) {
  Experiment experiment;
  experiment.stated.slope_u = u;
  return experiment;
}

std::vector<LackOfFit> tests_of_known(const Experiment& experiment, const ReadingSet& set) {
  Estimate estimate = estimate_known(set, set.field);
  test_lack_of_fit_of_inputs(experiment, set, Method::known, estimate);
  return estimate.statistics.lack_of_fit;
}

// T = y^T P y / nu of the means of the poses. P is that of generalised least squares.
LackOfFit test_by_hand(const Eigen::MatrixXd& X,
                       const Eigen::VectorXd& means,
                       const Eigen::MatrixXd& H,
                       const LackOfFit& plain) {
  const auto poses = static_cast<double>(means.size());
  const Eigen::MatrixXd D = Eigen::MatrixXd::Identity(means.size(), means.size()) *
                            std::pow(plain.pure_error_sd, 2) / times_each;
  const Eigen::MatrixXd W = (D + H * H.transpose()).inverse();
  const Eigen::MatrixXd P = W - W * X * (X.transpose() * W * X).inverse() * X.transpose() * W;
  const double nu = poses - static_cast<double>(X.cols());
  const double share = (D * P).trace() / nu;
  LackOfFit test = plain;
  test.lack_of_fit_dof = nu;
  test.f = means.dot(P * means) / nu;
  test.p_value = f_upper_p(test.f, nu, plain.pure_error_dof / (share * share));
  return test;
}

// Mean of an axis's readings in each pose of the repeated design, 12 values.
Eigen::VectorXd means_of_poses(const ReadingSet& set, Eigen::Index axis) {
  return set.response.col(axis).reshaped(12, times_each).rowwise().mean();
}

void expect_same_test(const LackOfFit& actual, const LackOfFit& expected, double tolerance) {
  EXPECT_EQ(actual.lack_of_fit_dof, expected.lack_of_fit_dof);
  EXPECT_NEAR(actual.f, expected.f, tolerance * expected.f);
  EXPECT_NEAR(actual.p_value, expected.p_value, 10.0 * tolerance);
  EXPECT_EQ(actual.pure_error_sd, expected.pure_error_sd);
  EXPECT_EQ(actual.pure_error_dof, expected.pure_error_dof);
}

TEST(TestLackOfFitOfInputs, IsGeneralizedLeastSquaresOfTheMeans) {
  constexpr double u = 5e-4;
  const ReadingSet set = repeated_poses(Eigen::Vector3d(7e-4, -4e-4, 1.0), 2);
  const Estimate before = estimate_known(set, set.field);
  const std::vector<LackOfFit> tests = tests_of_known(experiment_of_slope(u), set);
  ASSERT_EQ(tests.size(), 3U);
  const Eigen::MatrixXd X = test::rows_of(set, Eigen::Vector3d::UnitZ()).topRows(12);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const auto axis = static_cast<std::size_t>(k);
    Eigen::MatrixXd H(12, 2);
    for (Eigen::Index i = 0; i < 12; ++i) {
      for (int j = 0; j < 2; ++j) {
        const Eigen::Vector3d change =
            u * Eigen::Vector3d(Eigen::Vector3d::Unit(j)).cross(Eigen::Vector3d::UnitZ());
        H(i, j) = before.response.sensitivity.row(k).dot(
            set.rotation_sensor_from_table[static_cast<std::size_t>(i)] * change);
      }
    }
    expect_same_test(
        tests[axis],
        test_by_hand(X, means_of_poses(set, k), H, before.statistics.lack_of_fit[axis]), 1e-6);
    // The repeats alone do not explain the slope of the table, but its stated uncertainty does.
    EXPECT_GT(tests[axis].p_value, 0.01);
  }
  EXPECT_LT(before.statistics.lack_of_fit[0].p_value, 1e-3);
}

// Each axis fits the direction separately, which adds two columns.
TEST(TestLackOfFitOfInputs, FitsTheDirectionOfTheFieldByEachAxis) {
  constexpr double u = 4e-4;
  Experiment experiment;
  experiment.positioner = test::uncertain_cube(u);
  const ReadingSet set = repeated_poses(test::sloping_gravity, 2);
  Estimate estimate = estimate_joint(set);
  const Estimate before = estimate;
  test_lack_of_fit_of_inputs(experiment, set, Method::joint, estimate);
  const Eigen::Vector3d f = estimate.field.vector(0);
  const Eigen::Matrix<double, 3, 2> tangents = tangents_of(f);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::RowVector3d S = before.response.sensitivity.row(k);
    Eigen::MatrixXd X(12, 6);
    X.leftCols<4>() = test::rows_of(set, f).topRows(12);
    Eigen::MatrixXd H(12, 12);
    for (Eigen::Index i = 0; i < 12; ++i) {
      const DesignPoint& point = *set.readings[static_cast<std::size_t>(i)].point;
      const Eigen::Matrix3d R = Positioner().rotation_table_from_positioner(point);
      X.row(i).tail<2>() = S * R.transpose() * tangents;
      const Eigen::Matrix<double, 3, 18> change = change_with_normals(R, point, f);
      for (const Face face : all_faces) {
        const auto at = static_cast<Eigen::Index>(face);
        H.row(i).segment<2>(2 * at) =
            u * S * change.middleCols<3>(3 * at) * tangents_of(nominal_normal(face));
      }
    }
    const auto axis = static_cast<std::size_t>(k);
    expect_same_test(
        estimate.statistics.lack_of_fit[axis],
        test_by_hand(X, means_of_poses(set, k), H, before.statistics.lack_of_fit[axis]), 1e-5);
  }
}

TEST(TestLackOfFitOfInputs, IsThePlainTestOfInputsThatAreAlmostExact) {
  const ReadingSet set = repeated_poses(Eigen::Vector3d::UnitZ(), 3);
  const Estimate before = estimate_known(set, set.field);
  const std::vector<LackOfFit> tests = tests_of_known(experiment_of_slope(1e-9), set);
  for (std::size_t k = 0; k < 3; ++k) {
    const LackOfFit& plain = before.statistics.lack_of_fit[k];
    EXPECT_EQ(plain.lack_of_fit_dof, 8.0);
    EXPECT_EQ(plain.pure_error_dof, 24.0);
    expect_same_test(tests[k], plain, 1e-6);
  }
}

TEST(TestLackOfFitOfInputs, ChangesNoTestOfExactInputs) {
  const ReadingSet set = repeated_poses(test::sloping_gravity, 4);
  const Estimate before = estimate_known(set, set.field);
  const std::vector<LackOfFit> tests = tests_of_known({}, set);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(tests[k].f, before.statistics.lack_of_fit[k].f);
    EXPECT_EQ(tests[k].p_value, before.statistics.lack_of_fit[k].p_value);
  }
}

TEST(TestLackOfFitOfInputs, LeavesRobustFitsAlone) {
  ReadingSet set = repeated_poses(test::sloping_gravity, 5);
  Estimate estimate = estimate_known(set, set.field);
  const double before = estimate.statistics.lack_of_fit[0].f;
  set.robust = true;
  test_lack_of_fit_of_inputs(experiment_of_slope(1e-2), set, Method::known, estimate);
  EXPECT_EQ(estimate.statistics.lack_of_fit[0].f, before);
}

TEST(TestLackOfFitOfInputs, HasNoAnswerWithoutRepeats) {
  ReadingSet set =
      test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                         standard_design(24), pose_noise, 6);
  const std::vector<LackOfFit> tests = tests_of_known(experiment_of_slope(1e-3), set);
  for (const LackOfFit& test : tests) {
    EXPECT_TRUE(std::isnan(test.f) && std::isnan(test.p_value));
  }
  Estimate estimate = estimate_known(set, set.field);
  estimate.statistics.lack_of_fit.clear();
  test_lack_of_fit_of_inputs(experiment_of_slope(1e-3), set, Method::known, estimate);
  EXPECT_TRUE(estimate.statistics.lack_of_fit.empty());
}

// Repeats without noise differ by rounding only, so the test keeps its previous p.
TEST(TestLackOfFitOfInputs, DoesNotCompareWithRounding) {
  ReadingSet set =
      test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                         repeated_design(), 0.0, 7);
  set.field = test::gravity_in_table(Eigen::Vector3d::UnitZ());
  Estimate estimate = estimate_known(set, set.field);
  const double before = estimate.statistics.lack_of_fit[0].p_value;
  test_lack_of_fit_of_inputs(experiment_of_slope(1e-2), set, Method::known, estimate);
  EXPECT_EQ(estimate.statistics.lack_of_fit[0].p_value, before);
}

TEST(TestLackOfFitOfInputs, DoesNotKnowTheUnitOfAnAxis) {
  ReadingSet set = repeated_poses(Eigen::Vector3d(5e-4, 5e-4, 1.0), 8);
  const Experiment experiment = experiment_of_slope(4e-4);
  const std::vector<LackOfFit> before = tests_of_known(experiment, set);
  set.response.col(1) *= 1e3;
  const std::vector<LackOfFit> after = tests_of_known(experiment, set);
  EXPECT_NEAR(after[1].f, before[1].f, 1e-8 * before[1].f);
  EXPECT_NEAR(after[1].p_value, before[1].p_value, 1e-8);
  EXPECT_NEAR(after[1].pure_error_sd, 1e3 * before[1].pure_error_sd, 1e-9);
}

// A reading of weight w has the effect of w readings.
TEST(TestLackOfFitOfInputs, WeighsPosesByTheirReadings) {
  const ReadingSet set = repeated_poses(Eigen::Vector3d(5e-4, 5e-4, 1.0), 9);
  const Experiment experiment = experiment_of_slope(4e-4);
  const std::vector<LackOfFit> once = tests_of_known(experiment, set);
  ReadingSet heavier = set;
  heavier.weights *= 4.0;
  const std::vector<LackOfFit> four = tests_of_known(experiment, heavier);
  EXPECT_NEAR(four[2].pure_error_sd, 2.0 * once[2].pure_error_sd, 1e-12);
  EXPECT_NEAR(four[2].f, once[2].f, 1e-8 * once[2].f);
  // If an axis leaves out all readings of a pose, the pose is not in its test.
  ReadingSet fewer = set;
  for (const Eigen::Index i : {5, 17, 29}) {
    fewer.weights(i, 0) = 0.0;
  }
  const std::vector<LackOfFit> eleven = tests_of_known(experiment, fewer);
  EXPECT_EQ(eleven[0].lack_of_fit_dof, 7.0);
  EXPECT_EQ(eleven[0].pure_error_dof, 22.0);
  EXPECT_EQ(eleven[1].lack_of_fit_dof, 8.0);
}

TEST(TestLackOfFitOfInputs, StillSeesAPoseThatIsOff) {
  ReadingSet set = repeated_poses(Eigen::Vector3d::UnitZ(), 10);
  for (const Eigen::Index i : {3, 15, 27}) {
    set.response(i, 2) += 0.02;
  }
  const std::vector<LackOfFit> tests = tests_of_known(experiment_of_slope(5e-4), set);
  EXPECT_LT(tests[2].p_value, 1e-6);
  EXPECT_GT(tests[0].p_value, 1e-4);
}

// Random slopes with the stated uncertainty: most plain tests fail, and 5 % of the tests with
// shared errors fail.
TEST(TestLackOfFitOfInputs, IsRightAboutInputsAsTheyAreStated) {
  constexpr double u = 1e-3;
  constexpr int trials = 200;
  int plain = 0;
  int shared = 0;
  for (int trial = 0; trial < trials; ++trial) {
    RandomStream random(static_cast<std::uint64_t>(5000 + trial));
    const Eigen::Vector2d slope = u * random.normals<2>();
    const ReadingSet set = repeated_poses(Eigen::Vector3d(slope.x(), slope.y(), 1.0),
                                          static_cast<std::uint64_t>(trial));
    Estimate estimate = estimate_known(set, set.field);
    for (const LackOfFit& test : estimate.statistics.lack_of_fit) {
      plain += test.p_value < 0.05 ? 1 : 0;
    }
    test_lack_of_fit_of_inputs(experiment_of_slope(u), set, Method::known, estimate);
    for (const LackOfFit& test : estimate.statistics.lack_of_fit) {
      shared += test.p_value < 0.05 ? 1 : 0;
    }
  }
  EXPECT_GT(plain, 2 * trials);
  EXPECT_GT(shared, 3 * trials / 100);
  EXPECT_LT(shared, 3 * trials / 10);
}

}  // namespace
}  // namespace axiscal
