// SPDX-License-Identifier: Apache-2.0
// Readings that are kept out of a fit, compared with the prediction intervals of a textbook.
#include "calib/fit/confirmation_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/regression/common_noise.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

constexpr double kept_noise = 1e-3;

ReadingSet set_with_rows(const ReadingSet& set, const std::vector<std::size_t>& rows) {
  ReadingSet some = set;
  some.readings.clear();
  some.rotation_sensor_from_table.clear();
  std::vector<Eigen::Index> at;
  for (const std::size_t i : rows) {
    some.readings.push_back(set.readings[i]);
    some.rotation_sensor_from_table.push_back(set.rotation_sensor_from_table[i]);
    at.push_back(static_cast<Eigen::Index>(i));
  }
  some.response = set.response(at, Eigen::all);
  some.weights = set.weights(at, Eigen::all);
  if (set.effects.columns.cols() > 0) {
    some.effects.columns = set.effects.columns(at, Eigen::all);
  }
  return some;
}

// A run that is divided into fitted readings and readings that are kept out.
struct KeptOutRun {
  KeptOutRun(const ReadingSet& all, const std::vector<std::size_t>& gone)
      : kept_out(set_with_rows(all, gone)) {
    std::vector<std::size_t> rest;
    for (std::size_t i = 0; i < all.readings.size(); ++i) {
      if (std::find(gone.begin(), gone.end(), i) == gone.end()) {
        rest.push_back(i);
      }
    }
    fitted = set_with_rows(all, rest);
  }

  [[nodiscard]] Confirmation confirmed_by_known() const {
    return confirmed(fitted, kept_out, fitted.field, true).confirmation;
  }

  ReadingSet fitted;
  ReadingSet kept_out;
};

ReadingSet run_of_24(std::uint64_t seed, double noise = kept_noise) {
  return test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                            standard_design(24), noise, seed);
}

ReadingSet weighed_run(std::uint64_t seed) {
  ReadingSet all = run_of_24(seed);
  for (Eigen::Index i = 0; i < all.size(); ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      all.weights(i, k) = 0.4 + 0.3 * static_cast<double>((i + k) % 5);
    }
  }
  return all;
}

// The readings with weights for noise whose variance across the field is `ratio` times that along
// the field.
ReadingSet with_ratio(ReadingSet set, double ratio) {
  const Eigen::MatrixXd f =
      test::rows_of(set, test::sloping_gravity).rightCols<3>().rowwise().normalized();
  const Eigen::Matrix3d S = test::some_response().sensitivity.rowwise().normalized();
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double cosine = f.row(i).dot(S.row(k));
      set.weights(i, k) /= 1.0 + (ratio - 1.0) * (1.0 - cosine * cosine);
    }
  }
  return set;
}

struct Judged {
  double p_value = 0.0;
  double misfit = 0.0;  // -2 ln of the restricted likelihood
};

// Draper & Smith, Applied Regression Analysis, sec. 3.1: the q readings of an axis are tested by
// F(q, nu). The axes are combined by Fisher's method.
Judged judged(const ReadingSet& fitted, const ReadingSet& kept_out) {
  const Eigen::MatrixXd A = test::rows_of(fitted, test::sloping_gravity);
  const Eigen::MatrixXd X = test::rows_of(kept_out, test::sloping_gravity);
  const auto q = static_cast<double>(kept_out.size());
  const double nu = static_cast<double>(fitted.size()) - 4.0;
  Judged result;
  double fisher = 0.0;
  Eigen::MatrixXd residuals(fitted.size(), 3);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::VectorXd w = fitted.weights.col(k);
    const Eigen::MatrixXd information = A.transpose() * w.asDiagonal() * A;
    const Eigen::MatrixXd C = information.inverse();
    const Eigen::VectorXd b = C * (A.transpose() * w.cwiseProduct(fitted.response.col(k)));
    residuals.col(k) = w.cwiseSqrt().cwiseProduct(fitted.response.col(k) - A * b);
    const double s2 = residuals.col(k).squaredNorm() / nu;
    const Eigen::VectorXd e = kept_out.response.col(k) - X * b;
    Eigen::MatrixXd V = s2 * X * C * X.transpose();
    V.diagonal() += s2 * kept_out.weights.col(k).cwiseInverse();
    fisher -= 2.0 * std::log(f_upper_p(e.dot(V.inverse() * e) / q, q, nu));
    result.misfit +=
        nu * std::log(s2) + nu + std::log(information.determinant()) - w.array().log().sum();
  }
  const double loss = dof_reduction_factor(residuals, nu);
  result.p_value = chi_squared_upper_p(fisher / loss, 6.0 / loss);
  return result;
}

// The largest p over all ratios that the likelihood does not reject.
double largest_p(const ReadingSet& fitted, const ReadingSet& kept_out) {
  std::vector<Judged> all;
  double least = std::numeric_limits<double>::infinity();
  for (const double ratio : {0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0}) {
    all.push_back(judged(with_ratio(fitted, ratio), with_ratio(kept_out, ratio)));
    least = std::min(least, all.back().misfit);
  }
  double largest = 0.0;
  for (const Judged& one : all) {
    largest = one.misfit - least <= 3.84 ? std::max(largest, one.p_value) : largest;
  }
  return largest;
}

// Expects the textbook's intervals, which hold for noise that is equal in all directions.
void expect_textbook(const KeptOutRun& run) {
  const Confirmation confirmation = run.confirmed_by_known();
  const Eigen::MatrixXd A = test::rows_of(run.fitted, test::sloping_gravity);
  const Eigen::MatrixXd X = test::rows_of(run.kept_out, test::sloping_gravity);
  ASSERT_EQ(confirmation.readings.size(), run.kept_out.readings.size());
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::VectorXd w = run.fitted.weights.col(k);
    const Eigen::MatrixXd C = (A.transpose() * w.asDiagonal() * A).inverse();
    const Eigen::VectorXd b = C * (A.transpose() * w.cwiseProduct(run.fitted.response.col(k)));
    const double nu = static_cast<double>(run.fitted.size()) - 4.0;
    const double s2 = w.dot((run.fitted.response.col(k) - A * b).cwiseAbs2()) / nu;
    const Eigen::VectorXd e = run.kept_out.response.col(k) - X * b;
    Eigen::MatrixXd V = s2 * X * C * X.transpose();
    V.diagonal() += s2 * run.kept_out.weights.col(k).cwiseInverse();
    for (Eigen::Index i = 0; i < e.size(); ++i) {
      const ConfirmationReading& one = confirmation.readings[static_cast<std::size_t>(i)];
      EXPECT_NEAR(one.error(k), e(i), 1e-12);
      EXPECT_NEAR(one.half_width(k), student_t_factor(0.95, nu) * std::sqrt(V(i, i)), 1e-12);
    }
  }
  const double expected = largest_p(run.fitted, run.kept_out);
  EXPECT_NEAR(confirmation.p_value, expected, 1e-3 * expected);
  EXPECT_EQ(confirmation.passed, expected >= 0.05);
}

TEST(Confirmed, HasThePredictionIntervalOfOneReading) {
  expect_textbook(KeptOutRun(run_of_24(1), {9}));
}

TEST(Confirmed, TestsSeveralReadingsTogether) {
  expect_textbook(KeptOutRun(run_of_24(2), {0, 5, 11, 18}));
}

TEST(Confirmed, CountsTheWeightsOfBoth) {
  expect_textbook(KeptOutRun(weighed_run(3), {2, 7, 16}));
}

TEST(Confirmed, TakesMoreReadingsThanColumns) {
  expect_textbook(KeptOutRun(weighed_run(4), {1, 3, 5, 7, 9, 11, 13}));
}

TEST(Confirmed, KnowsTheReadingThatIsOff) {
  ReadingSet all = run_of_24(5);
  all.response(16, 1) += 20.0 * kept_noise;
  const Confirmation confirmation = KeptOutRun(all, {4, 16, 21}).confirmed_by_known();
  EXPECT_FALSE(confirmation.passed);
  EXPECT_LT(confirmation.p_value, 1e-4);
  ASSERT_EQ(confirmation.readings.size(), 3U);
  EXPECT_EQ(confirmation.readings[1].run, 17);
  EXPECT_FALSE(confirmation.readings[1].within);
  EXPECT_NEAR(confirmation.readings[1].error(1), 20.0 * kept_noise, 5.0 * kept_noise);
  EXPECT_LT(std::abs(confirmation.readings[1].error(0)), confirmation.readings[1].half_width(0));
  // A reading that is kept out does not change the prediction of another one.
  const Confirmation alone = KeptOutRun(all, {4, 21, 16}).confirmed_by_known();
  EXPECT_MATRIX_NEAR(alone.readings[0].error, confirmation.readings[0].error, 1e-14);
  EXPECT_MATRIX_NEAR(alone.readings[2].error, confirmation.readings[1].error, 1e-14);
  EXPECT_NEAR(alone.p_value, confirmation.p_value, 1e-6 * confirmation.p_value);
}

TEST(Confirmed, DoesNotKnowTheUnitOfAnAxis) {
  ReadingSet all = run_of_24(6);
  const Confirmation before = KeptOutRun(all, {3, 8}).confirmed_by_known();
  all.response.col(2) *= 250.0;
  const Confirmation after = KeptOutRun(all, {3, 8}).confirmed_by_known();
  EXPECT_NEAR(after.p_value, before.p_value, 1e-6 * before.p_value);
  EXPECT_NEAR(after.readings[1].error(2), 250.0 * before.readings[1].error(2), 1e-10);
  EXPECT_NEAR(after.readings[1].half_width(2), 250.0 * before.readings[1].half_width(2), 1e-10);
}

TEST(Confirmed, HasNoErrorForAnAxisThatDoesNotUseTheReading) {
  ReadingSet all = run_of_24(7);
  all.weights(5, 0) = 0.0;
  all.response(5, 0) += 3.0;
  const Confirmation confirmation = KeptOutRun(all, {5}).confirmed_by_known();
  EXPECT_TRUE(std::isnan(confirmation.readings[0].error(0)));
  EXPECT_TRUE(std::isnan(confirmation.readings[0].half_width(0)));
  EXPECT_FALSE(std::isnan(confirmation.readings[0].error(1)));
  all.weights(5, 0) = 1.0;
  EXPECT_FALSE(KeptOutRun(all, {5}).confirmed_by_known().passed);
  // p is then computed from the other two axes.
  const double p = confirmation.p_value;
  all.response(5, 0) -= 1e3;
  all.weights(5, 0) = 0.0;
  EXPECT_NEAR(KeptOutRun(all, {5}).confirmed_by_known().p_value, p, 1e-12);
}

// The axes share the fitted direction. The reference is an independent fit of all columns.
TEST(Confirmed, CountsTheDirectionThatWasFitted) {
  const ReadingSet all = run_of_24(8);
  const KeptOutRun run(all, {6, 19});
  const Estimate estimate = estimate_joint(run.fitted);
  const Confirmation joint =
      confirmed(run.fitted, run.kept_out, estimate.field, false).confirmation;
  const Confirmation known = confirmed(run.fitted, run.kept_out, estimate.field, true).confirmation;
  const Eigen::MatrixXd S = estimate.response.sensitivity;
  const Eigen::Vector3d f = estimate.field.vector(0);
  const auto jacobian = [&](const ReadingSet& set) {
    const Eigen::MatrixXd X = test::rows_of(set, f);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3 * set.size(), 14);
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      for (Eigen::Index k = 0; k < 3; ++k) {
        J.row(3 * i + k).segment<4>(4 * k) = X.row(i);
        J.row(3 * i + k).tail<2>() =
            S.row(k) * set.rotation_sensor_from_table[static_cast<std::size_t>(i)].leftCols<2>();
      }
    }
    return J;
  };
  // The rows of each axis are divided by its estimated noise.
  const Eigen::MatrixXd J = jacobian(run.fitted);
  const Eigen::MatrixXd K = jacobian(run.kept_out);
  Eigen::VectorXd sigma(3);
  for (Eigen::Index k = 0; k < 3; ++k) {
    sigma(k) = estimate.statistics.residual_sd(k);
  }
  const Eigen::MatrixXd scaled =
      sigma.cwiseInverse().replicate(run.fitted.size(), 1).asDiagonal() * J;
  const Eigen::MatrixXd C = (scaled.transpose() * scaled).inverse();
  for (Eigen::Index i = 0; i < 2; ++i) {
    const auto one = static_cast<std::size_t>(i);
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Eigen::RowVectorXd row = K.row(3 * i + k);
      const double sd = std::sqrt(sigma(k) * sigma(k) + row.dot(C * row.transpose()));
      const double t = student_t_factor(0.95, estimate.statistics.degrees_of_freedom(k));
      EXPECT_NEAR(joint.readings[one].half_width(k) / (t * sd), 1.0, 0.02);
      const double predicted = estimate.response.bias(k) +
                               S.row(k).dot(run.kept_out.rotation_sensor_from_table[one] * f);
      EXPECT_NEAR(joint.readings[one].error(k), run.kept_out.response(i, k) - predicted, 1e-5);
    }
    EXPECT_GT(joint.readings[one].half_width.norm(), known.readings[one].half_width.norm());
  }
}

TEST(Confirmed, FollowsTheDriftOfTheRun) {
  ReadingSet all = run_of_24(9);
  all.effects = run_effects(all.readings, all.weights, {.drift = true});
  all.response += 0.3 * all.effects.columns.col(0) * Eigen::RowVector3d(1.0, -1.0, 2.0);
  const Confirmation confirmation = KeptOutRun(all, {0, 12, 23}).confirmed_by_known();
  EXPECT_GT(confirmation.p_value, 1e-3);
  for (const ConfirmationReading& one : confirmation.readings) {
    EXPECT_LT(one.error.cwiseAbs().maxCoeff(), 6.0 * kept_noise);
  }
  // Predictions are less certain at the ends of the run than in its middle.
  EXPECT_GT(confirmation.readings[0].half_width(0), confirmation.readings[1].half_width(0));
  all.effects = {};
  EXPECT_LT(KeptOutRun(all, {0, 12, 23}).confirmed_by_known().readings[1].half_width(0), 1.0);
  EXPECT_GT(KeptOutRun(all, {0, 12, 23}).confirmed_by_known().readings[1].half_width(0),
            10.0 * confirmation.readings[1].half_width(0));
}

TEST(Confirmed, FollowsTheTemperature) {
  ReadingSet all = run_of_24(10);
  all.temperature.order = 1;
  all.temperature.d = Eigen::MatrixXd::Zero(24, 3);
  all.temperature.scale = Eigen::MatrixXd::Zero(3, 1);
  all.temperature.along = test::some_response().sensitivity;
  for (Eigen::Index i = 0; i < 24; ++i) {
    all.temperature.d.row(i).setConstant(static_cast<double>((7 * i) % 24) - 11.5);
    all.response.row(i).array() += 0.02 * all.temperature.d(i, 0);
  }
  const std::vector<std::size_t> gone = {2, 13};
  KeptOutRun run(all, gone);
  run.kept_out.temperature.d = all.temperature.d({2, 13}, Eigen::all);
  Eigen::MatrixXd d(22, 3);
  for (Eigen::Index i = 0, row = 0; i < 24; ++i) {
    if (i != 2 && i != 13) {
      d.row(row++) = all.temperature.d.row(i);
    }
  }
  run.fitted.temperature.d = d;
  const Confirmation confirmation = run.confirmed_by_known();
  EXPECT_GT(confirmation.p_value, 1e-3);
  for (const ConfirmationReading& one : confirmation.readings) {
    EXPECT_LT(one.error.cwiseAbs().maxCoeff(), 6.0 * kept_noise);
    EXPECT_LT(one.half_width.maxCoeff(), 6.0 * kept_noise);
  }
}

TEST(Confirmed, RefusesAFitThatPredictsNone) {
  const ReadingSet all = run_of_24(11);
  std::vector<std::size_t> gone;
  for (std::size_t i = 4; i < 24; ++i) {
    gone.push_back(i);
  }
  const KeptOutRun run(all, gone);
  EXPECT_THAT([&] { static_cast<void>(run.confirmed_by_known()); },
              testing::ThrowsMessage<RefusedError>(testing::HasSubstr("take more readings")));
}

// 5 % of good runs fail, and 5 % of the errors are outside their intervals.
TEST(Confirmed, IsRightAboutGoodRuns) {
  constexpr int trials = 300;
  int failed = 0;
  int outside = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const KeptOutRun run(run_of_24(static_cast<std::uint64_t>(1000 + trial)), {1, 10, 20});
    const Estimate estimate = estimate_joint(run.fitted);
    const Confirmation confirmation =
        confirmed(run.fitted, run.kept_out, estimate.field, false).confirmation;
    failed += confirmation.passed ? 0 : 1;
    for (const ConfirmationReading& one : confirmation.readings) {
      outside += static_cast<int>((one.error.array().abs() > one.half_width.array()).count());
    }
  }
  EXPECT_GE(failed, 3);
  EXPECT_LE(failed, 32);
  EXPECT_NEAR(static_cast<double>(outside) / (9.0 * trials), 0.05, 0.02);
}

// The biases of a separate block may differ, so their common shift is not tested.
TEST(Confirmed, DoesNotCompareTheShiftOfANewBlock) {
  ReadingSet all = run_of_24(11);
  const std::vector<std::size_t> gone = {2, 6, 13, 19};
  for (const std::size_t i : gone) {
    all.response.row(static_cast<Eigen::Index>(i)).array() += 15.0 * kept_noise;
  }
  const KeptOutRun same_block(all, gone);
  const ConfirmedReadings shifted =
      confirmed(same_block.fitted, same_block.kept_out, all.field, true);
  EXPECT_FALSE(shifted.confirmation.passed);
  ASSERT_EQ(shifted.notes.size(), 1U);
  EXPECT_THAT(shifted.notes[0].message, testing::HasSubstr("A common shift of the biases"));
  for (const std::size_t i : gone) {
    all.readings[i].block = 2;
  }
  const KeptOutRun own_block(all, gone);
  const ConfirmedReadings apart = confirmed(own_block.fitted, own_block.kept_out, all.field, true);
  EXPECT_TRUE(apart.confirmation.passed);
  ASSERT_EQ(apart.notes.size(), 1U);
  EXPECT_THAT(apart.notes[0].message, testing::HasSubstr("is therefore not tested"));
}

}  // namespace
}  // namespace axiscal
