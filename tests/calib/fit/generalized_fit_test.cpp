// SPDX-License-Identifier: Apache-2.0
// Errors that several readings share. Variances of seats are compared with the equations of
// restricted likelihood, and errors of inputs with explicit matrices.
#include "calib/fit/generalized_fit.hpp"

#include <cmath>

#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/record/parameter_names.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

constexpr double laid_noise = 2e-4;
constexpr double laid_turn = 1e-3;

TableField field_of_layings() {
  return test::gravity_in_table(test::sloping_gravity);
}

// Readings of a cube that is turned at random in each laying. Each laying has `readings_each`
// consecutive readings.
ReadingSet set_of_layings(double turn_sd, std::size_t readings_each, std::uint64_t seed) {
  std::vector<DesignEntry> design;
  for (const DesignEntry& entry : standard_design(24)) {
    design.insert(design.end(), readings_each, entry);
  }
  ReadingSet set =
      test::labelled_set(test::some_response(), field_of_layings(), design, laid_noise, seed);
  RandomStream random(seed + 1000);
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    if (i % readings_each == 0) {
      turn = turn_sd * random.normals<3>();
    }
    set.response.row(static_cast<Eigen::Index>(i)) +=
        (test::some_response().sensitivity *
         (set.rotation_sensor_from_table[i] * test::sloping_gravity.cross(turn)))
            .transpose();
  }
  return set;
}

Estimate known_estimate(const ReadingSet& set) {
  Estimate estimate = estimate_known(set, set.field);
  fill_intervals(estimate.statistics);
  return estimate;
}

std::vector<UncertaintySource> weighed(const Experiment& experiment,
                                       const ReadingSet& set,
                                       Estimate& estimate) {
  return weigh_shared_errors(experiment, SolvedReadings(set, true), Method::known, estimate);
}

// Design matrix of all axes, 3n x 12. Row 3i + k has the row [1, f] of reading i in the columns of
// axis k.
Eigen::MatrixXd stacked_rows(const ReadingSet& set) {
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(3 * set.size(), 12);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      all.row(3 * i + k).segment<4>(4 * k) = X.row(i);
    }
  }
  return all;
}

// The matrices Q_q of V = sum theta_q Q_q: one for the noise of each axis, and one for the turns of
// layings.
std::vector<Eigen::MatrixXd> parts_of_covariance(const ReadingSet& set,
                                                 const SensitivityMatrix& S,
                                                 Eigen::Index readings_each) {
  const Eigen::Index n = set.size();
  std::vector<Eigen::MatrixXd> parts(4, Eigen::MatrixXd::Zero(3 * n, 3 * n));
  Eigen::MatrixXd turns = Eigen::MatrixXd::Zero(3 * n, 3 * n / readings_each);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      parts[static_cast<std::size_t>(k)](3 * i + k, 3 * i + k) = 1.0;
      turns.row(3 * i + k).segment<3>(3 * (i / readings_each)) =
          S.row(k) * set.rotation_sensor_from_table[static_cast<std::size_t>(i)] *
          cross_matrix(test::sloping_gravity);
    }
  }
  parts[3] = turns * turns.transpose();
  return parts;
}

// Expects tr(P Q_q) = y^T P Q_q P y for each component (Searle, Casella & McCulloch, sec. 6.6).
void expect_restricted_likelihood(std::size_t readings_each) {
  const ReadingSet set = set_of_layings(laid_turn, readings_each, 31);
  Experiment experiment;
  experiment.fit.seats = SeatSetup::fit;
  Estimate estimate = known_estimate(set);
  const SensitivityMatrix S = estimate.response.sensitivity;
  EXPECT_TRUE(weighed(experiment, set, estimate).empty());
  ASSERT_EQ(estimate.statistics.components.size(), 1U);
  const ScatterComponent& seats = estimate.statistics.components.front();
  EXPECT_EQ(seats.name, "seats");
  EXPECT_NEAR(seats.sd(0), laid_turn, 0.3 * laid_turn);
  const std::vector<Eigen::MatrixXd> Q =
      parts_of_covariance(set, S, static_cast<Eigen::Index>(readings_each));
  Eigen::MatrixXd V = seats.sd(0) * seats.sd(0) * Q[3];
  for (Eigen::Index k = 0; k < 3; ++k) {
    V += std::pow(estimate.statistics.residual_sd(k), 2) * Q[static_cast<std::size_t>(k)];
  }
  const Eigen::MatrixXd W = V.inverse();
  const Eigen::MatrixXd X = stacked_rows(set);
  const Eigen::MatrixXd C = (X.transpose() * W * X).inverse();
  const Eigen::VectorXd y = set.response.transpose().reshaped();
  const Eigen::VectorXd b = C * (X.transpose() * (W * y));
  for (Eigen::Index k = 0; k < 3; ++k) {
    EXPECT_NEAR(estimate.response.bias(k), b(4 * k), 1e-7);
    EXPECT_MATRIX_NEAR(estimate.response.sensitivity.row(k).transpose(), b.segment<3>(4 * k + 1),
                       1e-7);
  }
  EXPECT_MATRIX_NEAR(estimate.statistics.covariance, C, 1e-4 * C.cwiseAbs().maxCoeff());
  const Eigen::MatrixXd P = W - W * X * C * X.transpose() * W;
  const Eigen::VectorXd Py = P * y;
  for (const Eigen::MatrixXd& part : Q) {
    const double trace = P.cwiseProduct(part).sum();
    EXPECT_NEAR(Py.dot(part * Py), trace, 1e-4 * trace);
  }
  // The covariance is the sum of two positive parts, one of the seats and one of the noise.
  const Eigen::MatrixXd of_noise = estimate.statistics.covariance - seats.covariance;
  EXPECT_GT(of_noise.diagonal().minCoeff(), 0.0);
  EXPECT_GT(seats.covariance.diagonal().minCoeff(), 0.0);
}

TEST(SeatsOfLayings, SolveTheEquationsOfRestrictedLikelihood) {
  expect_restricted_likelihood(1);
}

// Two readings of one laying have the same turn.
TEST(SeatsOfLayings, AreThoseOfRepeatsTogether) {
  expect_restricted_likelihood(2);
}

TEST(SeatsOfLayings, AreNotFoundInWhiteNoise) {
  int found = 0;
  for (std::uint64_t seed = 60; seed < 100; ++seed) {
    const ReadingSet set = set_of_layings(0.0, 1, seed);
    Estimate estimate = known_estimate(set);
    const Estimate before = estimate;
    EXPECT_TRUE(weighed({}, set, estimate).empty());
    if (!estimate.statistics.components.empty()) {
      ++found;
      continue;
    }
    EXPECT_EQ(estimate.response.bias, before.response.bias);
    EXPECT_EQ(estimate.statistics.covariance, before.statistics.covariance);
    EXPECT_TRUE(estimate.notes.empty());
  }
  EXPECT_LE(found, 6);
}

TEST(SeatsOfLayings, AreNotLookedForUnlessWanted) {
  const ReadingSet set = set_of_layings(laid_turn, 1, 32);
  Experiment experiment;
  experiment.fit.seats = SeatSetup::none;
  Estimate estimate = known_estimate(set);
  EXPECT_TRUE(weighed(experiment, set, estimate).empty());
  EXPECT_TRUE(estimate.statistics.components.empty());
  weighed({}, set, estimate);  // the default setup
  ASSERT_EQ(estimate.statistics.components.size(), 1U);
  EXPECT_THAT(estimate.notes, test::HasNote(testing::HasSubstr("each time the cube is laid down")));
}

// The sum of both covariances is that of generalised least squares. Each part is computed from its
// own errors.
TEST(WeighSharedErrors, DividesTheCovarianceBetweenNoiseAndInputs) {
  constexpr double u = 1e-3;
  const ReadingSet set = set_of_layings(0.0, 1, 33);
  Experiment experiment;
  experiment.fit.seats = SeatSetup::none;
  experiment.stated.slope_u = u;
  Estimate estimate = known_estimate(set);
  const SensitivityMatrix S = estimate.response.sensitivity;
  const std::vector<UncertaintySource> sources = weighed(experiment, set, estimate);
  ASSERT_EQ(sources.size(), 1U);
  EXPECT_EQ(sources.front().input_u, u);
  EXPECT_EQ(sources.front().type, "B");
  EXPECT_TRUE(std::isinf(sources.front().degrees_of_freedom));
  Eigen::MatrixXd H(3 * set.size(), 2);
  Eigen::VectorXd noise(3 * set.size());
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      H.row(3 * i + k) =
          -u * (S.row(k) * set.rotation_sensor_from_table[static_cast<std::size_t>(i)] *
                cross_matrix(test::sloping_gravity))
                   .leftCols<2>();
      noise(3 * i + k) = std::pow(estimate.statistics.residual_sd(k), 2);
    }
  }
  Eigen::MatrixXd V = H * H.transpose();
  V.diagonal() += noise;
  const Eigen::MatrixXd W = V.inverse();
  const Eigen::MatrixXd X = stacked_rows(set);
  const Eigen::MatrixXd C = (X.transpose() * W * X).inverse();
  const Eigen::MatrixXd by_readings = C * X.transpose() * W;
  const Eigen::MatrixXd of_inputs = by_readings * H * (by_readings * H).transpose();
  const Eigen::MatrixXd of_noise = by_readings * noise.asDiagonal() * by_readings.transpose();
  EXPECT_MATRIX_NEAR(sources.front().covariance, of_inputs, 1e-4 * C.cwiseAbs().maxCoeff());
  EXPECT_MATRIX_NEAR(estimate.statistics.covariance, of_noise, 1e-4 * C.cwiseAbs().maxCoeff());
  EXPECT_MATRIX_NEAR(sources.front().covariance + estimate.statistics.covariance, C,
                     1e-4 * C.cwiseAbs().maxCoeff());
}

TEST(WeighSharedErrors, SaysThatRobustFitsLackTheFaces) {
  const ReadingSet set = set_of_layings(0.0, 1, 34);
  Experiment experiment;
  experiment.positioner = test::uncertain_cube(1e-3);
  experiment.fit.robust = true;
  Estimate estimate = known_estimate(set);
  const Eigen::MatrixXd before = estimate.statistics.covariance;
  EXPECT_TRUE(weighed(experiment, set, estimate).empty());
  EXPECT_EQ(estimate.statistics.covariance, before);
  ASSERT_EQ(estimate.notes.size(), 1U);
  EXPECT_EQ(estimate.notes.front().code, NoteCode::face_normals);
}

// The most likely errors of the inputs are H^T V^-1 (y - X b) (Robinson 1991).
TEST(WithoutSharedErrors, TakesTheMostLikelyErrorsOff) {
  constexpr double u = 1e-3;
  const LinearResponse truth{.bias = Eigen::VectorXd::Constant(1, 0.1),
                             .sensitivity = Eigen::RowVector3d(0.3, -0.2, 2.0)};
  const TableField level = test::gravity_in_table(Eigen::Vector3d::UnitZ());
  ReadingSet set =
      test::labelled_set(truth, test::gravity_in_table(Eigen::Vector3d(1.5e-3, -0.8e-3, 1.0)),
                         standard_design(24), laid_noise, 35);
  set.field = level;
  Experiment experiment;
  experiment.stated.slope_u = u;
  const Estimate estimate = known_estimate(set);
  const auto without = without_shared_errors(experiment, set, Method::known, estimate, set);
  ASSERT_TRUE(without.has_value());
  // The reference uses the noise that the fit with these errors estimates by restricted likelihood.
  Estimate fitted = estimate;
  weighed(experiment, set, fitted);
  const double s2 = std::pow(fitted.statistics.residual_sd(0), 2);
  const Eigen::MatrixXd X = test::rows_of(set, Eigen::Vector3d::UnitZ());
  Eigen::MatrixXd H(24, 2);
  for (Eigen::Index i = 0; i < 24; ++i) {
    H.row(i) = -u * (fitted.response.sensitivity *
                     set.rotation_sensor_from_table[static_cast<std::size_t>(i)] *
                     cross_matrix(Eigen::Vector3d::UnitZ()))
                        .leftCols<2>();
  }
  const Eigen::MatrixXd W = (s2 * Eigen::MatrixXd::Identity(24, 24) + H * H.transpose()).inverse();
  const Eigen::VectorXd y = set.response.col(0);
  const Eigen::VectorXd b = (X.transpose() * W * X).ldlt().solve(X.transpose() * (W * y));
  const Eigen::VectorXd errors = H.transpose() * W * (y - X * b);
  EXPECT_MATRIX_NEAR(without->response.col(0), y - H * errors, 1e-3 * laid_noise);
  // The most likely errors are the slope of the table, so the residuals become smaller.
  EXPECT_NEAR(u * errors(1), 1.5e-3, 3e-4);
  const Estimate after = known_estimate(*without);
  EXPECT_LT(after.statistics.residual_sd(0), 0.3 * estimate.statistics.residual_sd(0));
  EXPECT_NEAR(after.statistics.residual_sd(0) / laid_noise, 1.0, 0.4);
}

// The errors of the inputs also change readings that are not in the fit.
TEST(WithoutSharedErrors, ServesOtherReadings) {
  const ReadingSet all = set_of_layings(0.0, 1, 36);
  ReadingSet sloping = all;
  for (Eigen::Index i = 0; i < all.size(); ++i) {
    const Eigen::Matrix3d& R = all.rotation_sensor_from_table[static_cast<std::size_t>(i)];
    sloping.response.row(i) +=
        (test::some_response().sensitivity * R * Eigen::Vector3d(2e-3, 0.0, 0.0)).transpose();
  }
  Experiment experiment;
  experiment.stated.slope_u = 2e-3;
  const Estimate estimate = known_estimate(sloping);
  const auto own = without_shared_errors(experiment, sloping, Method::known, estimate, sloping);
  ReadingSet later = sloping;
  later.response.setZero();
  const auto other = without_shared_errors(experiment, sloping, Method::known, estimate, later);
  ASSERT_TRUE(own.has_value() && other.has_value());
  EXPECT_MATRIX_NEAR(other->response, own->response - sloping.response, 1e-12);
  EXPECT_LT((own->response - all.response).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(WithoutSharedErrors, IsNoneIfAllInputsAreExact) {
  const ReadingSet set = set_of_layings(0.0, 1, 37);
  const Estimate estimate = known_estimate(set);
  EXPECT_FALSE(without_shared_errors({}, set, Method::known, estimate, set).has_value());
  Experiment robust;
  robust.stated.slope_u = 1e-3;
  EXPECT_TRUE(without_shared_errors(robust, set, Method::known, estimate, set).has_value());
  robust.fit.robust = true;
  EXPECT_FALSE(without_shared_errors(robust, set, Method::known, estimate, set).has_value());
}

// Readings whose first axis has a squared term along its sensitive direction.
ReadingSet bent_set(double bend, std::uint64_t seed) {
  ReadingSet set = set_of_layings(0.0, 1, seed);
  const Eigen::RowVector3d along = test::some_response().sensitivity.row(0).normalized();
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const double f = along.dot(set.rotation_sensor_from_table[static_cast<std::size_t>(i)] *
                               test::sloping_gravity);
    set.response(i, 0) += bend * f * f;
  }
  return set;
}

std::optional<CurvatureTest> curvature_of(const Experiment& experiment, const ReadingSet& set) {
  return test_curvature(experiment, SolvedReadings(set, true), Method::known, known_estimate(set));
}

// If equal noise is stated, the test is a textbook's F test over all axes.
TEST(TestCurvature, AgreesWithTheRegressionOnSquares) {
  ReadingSet set = bent_set(2.0 * laid_noise, 41);
  set.noise_ratio = Eigen::Vector3d::Ones();
  const auto test = curvature_of({}, set);
  ASSERT_TRUE(test.has_value());
  const SensitivityMatrix S = known_estimate(set).response.sensitivity;
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  double straight = 0.0;
  double bent = 0.0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    Eigen::MatrixXd with(24, 5);
    with << X, (X.rightCols<3>() * S.row(k).normalized().transpose()).cwiseAbs2();
    const Eigen::VectorXd y = set.response.col(k);
    const Eigen::VectorXd b = with.householderQr().solve(y);
    straight += (y - X * X.householderQr().solve(y)).squaredNorm();
    bent += (y - with * b).squaredNorm();
    EXPECT_NEAR(test->bends(k), test::sloping_gravity.squaredNorm() * b(4), 1e-9);
  }
  const double f = ((straight - bent) / 3.0) / (bent / 57.0);
  EXPECT_NEAR(test->p_value, f_upper_p(f, 3.0, 57.0), 1e-6);
}

TEST(TestCurvature, FindsTheBendOfAnAxis) {
  const double bend = 8.0 * laid_noise;
  const auto test = curvature_of({}, bent_set(bend, 42));
  ASSERT_TRUE(test.has_value());
  EXPECT_LT(test->p_value, 1e-6);
  EXPECT_NEAR(test->bends(0), bend, 3.0 * laid_noise);
  EXPECT_LT(std::abs(test->bends(1)), 3.0 * laid_noise);
  EXPECT_GT(curvature_of({}, bent_set(0.0, 42))->p_value, 0.01);
}

// Opposite faces that are not parallel have the effect of a squared term, so uncertain faces make
// the test less significant.
TEST(TestCurvature, CountsTheUncertaintyOfTheFaces) {
  const ReadingSet set = bent_set(8.0 * laid_noise, 43);
  Experiment experiment;
  experiment.positioner = test::uncertain_cube(2e-3);
  const double exact = curvature_of({}, set)->p_value;
  const double uncertain = curvature_of(experiment, set)->p_value;
  EXPECT_LT(exact, 1e-6);
  EXPECT_GT(uncertain, 1e3 * exact);
}

TEST(TestCurvature, HasNoAnswerForRobustOrExactReadings) {
  const ReadingSet set = bent_set(0.0, 44);
  Experiment robust;
  robust.fit.robust = true;
  EXPECT_FALSE(curvature_of(robust, set).has_value());
  const ReadingSet exact =
      test::labelled_set(test::some_response(), field_of_layings(), standard_design(24), 0.0, 1);
  EXPECT_FALSE(curvature_of({}, exact).has_value());
}

}  // namespace
}  // namespace axiscal
