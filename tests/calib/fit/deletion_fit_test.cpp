// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/deletion_fit.hpp"

#include <cmath>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "axiscal/calib/distributions.hpp"
#include "labelled_set.hpp"

namespace axiscal {
namespace {

// p of a reading against its prediction by the other readings. Each axis has the prediction
// interval of a textbook (Draper & Smith, Applied Regression Analysis, sec. 3.1); the axes are
// combined by Fisher's method.
double p_by_hand(const ReadingSet& set, std::size_t left_out) {
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  std::vector<Eigen::Index> others;
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    if (i != static_cast<Eigen::Index>(left_out)) {
      others.push_back(i);
    }
  }
  const Eigen::MatrixXd A = X(others, Eigen::all);
  const Eigen::MatrixXd C = (A.transpose() * A).inverse();
  const Eigen::RowVectorXd x = X.row(static_cast<Eigen::Index>(left_out));
  const double nu = static_cast<double>(others.size()) - 4.0;
  double sum = 0.0;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const Eigen::VectorXd y = set.response.col(k)(others);
    const Eigen::VectorXd b = C * (A.transpose() * y);
    const double s2 = (y - A * b).squaredNorm() / nu;
    const double e = set.response(static_cast<Eigen::Index>(left_out), k) - x.dot(b);
    const double f = e * e / (s2 * (1.0 + (x * C * x.transpose())(0)));
    sum -= 2.0 * std::log(f_upper_p(f, 1.0, nu));
  }
  return chi_squared_upper_p(sum, 2.0 * static_cast<double>(set.axis_count()));
}

TEST(DeletionFit, IsThePredictionOfTheOthersWhereTheFieldIsKnown) {
  const TableField field = test::gravity_in_table(test::sloping_gravity);
  ReadingSet set = test::labelled_set(test::some_response(), field, standard_design(24), 1e-3, 7);
  set.response(5, 1) += 4e-3;
  const DeletionFit fit(set, field, true);
  for (const std::size_t i : {std::size_t{0}, std::size_t{5}, std::size_t{17}}) {
    const double expected = p_by_hand(set, i);
    // The noise of the axes is iterated to a relative change of 1e-6.
    EXPECT_NEAR(fit.p_value({i}, Eigen::MatrixXd::Ones(1, 1)).value(), expected, 1e-4 * expected);
  }
  EXPECT_LT(p_by_hand(set, 5), 1e-2);
}

// Compares the predictions of the readings `gone` with the weighted regression of all other
// readings.
void expect_predictions_by_hand(const ReadingSet& set,
                                const TableField& field,
                                const std::vector<std::size_t>& gone) {
  const auto predictions = DeletionFit(set, field, true).predictions(gone);
  ASSERT_TRUE(predictions.has_value());
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    Eigen::VectorXd w = set.weights.col(k);
    w(gone).setZero();
    const Eigen::MatrixXd C = (X.transpose() * w.asDiagonal() * X).inverse();
    const Eigen::VectorXd b = C * (X.transpose() * w.cwiseProduct(set.response.col(k)));
    const double nu = static_cast<double>((w.array() > 0.0).count()) - 4.0;
    const double s2 = w.dot((set.response.col(k) - X * b).cwiseAbs2()) / nu;
    for (std::size_t j = 0; j < gone.size(); ++j) {
      const auto i = static_cast<Eigen::Index>(gone[j]);
      const DeletionFit::Prediction& one = (*predictions)[j];
      EXPECT_EQ(one.degrees_of_freedom(k), nu);
      if (!(set.weights(i, k) > 0.0)) {
        EXPECT_TRUE(std::isnan(one.error(k)) && std::isnan(one.sd(k)));
        continue;
      }
      const double variance =
          s2 * (1.0 / set.weights(i, k) + (X.row(i) * C * X.row(i).transpose())(0));
      EXPECT_NEAR(one.error(k), set.response(i, k) - X.row(i).dot(b), 1e-12);
      EXPECT_NEAR(one.sd(k), std::sqrt(variance), 1e-12);
    }
  }
}

// Several readings are left out together. Their weights differ by axis. Their number is less or
// greater than the number of columns.
TEST(DeletionFit, PredictsReadingsThatAreLeftOutTogether) {
  const TableField field = test::gravity_in_table(test::sloping_gravity);
  ReadingSet set = test::labelled_set(test::some_response(), field, standard_design(24), 1e-3, 8);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
      set.weights(i, k) = 0.5 + 0.25 * static_cast<double>((i + 2 * k) % 4);
    }
  }
  set.weights(3, 1) = 0.0;
  expect_predictions_by_hand(set, field, {2, 3, 11});
  expect_predictions_by_hand(set, field, {2, 3, 7, 11, 15, 20});
}

TEST(DeletionFit, HasNoAnswerWhereTheOthersDetermineNothing) {
  const TableField field = test::gravity_in_table(test::sloping_gravity);
  const ReadingSet set =
      test::labelled_set(test::some_response(), field, standard_design(6), 1e-3, 7);
  const DeletionFit fit(set, field, true);
  EXPECT_FALSE(fit.p_value({0, 1, 2}, Eigen::MatrixXd::Identity(3, 3)).has_value());
}

}  // namespace
}  // namespace axiscal
