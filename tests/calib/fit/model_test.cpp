// SPDX-License-Identifier: Apache-2.0
// Model and Fit, compared with explicit matrices.
#include "calib/fit/model.hpp"

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "axiscal/core/rotation.hpp"
#include "calib/fit/fit.hpp"
#include "labelled_set.hpp"

namespace axiscal {
namespace {

constexpr double model_noise = 1e-4;

ReadingSet some_set(std::uint64_t seed, int points = 24) {
  return test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                            standard_design(points), model_noise, seed);
}

TableField level_field() {
  return test::gravity_in_table(Eigen::Vector3d::UnitZ() * test::sloping_gravity.norm());
}

Eigen::VectorXd ones(const ReadingSet& set) {
  return Eigen::VectorXd::Ones(set.axis_count());
}

// All residuals at a place, the axes below each other.
Eigen::VectorXd residuals_at(const Model& model, const Place& place) {
  const auto solution = model.at(place);
  const Eigen::Index n = model.readings().size();
  Eigen::VectorXd all(n * model.readings().axis_count());
  for (Eigen::Index k = 0; k < model.readings().axis_count(); ++k) {
    all.segment(n * k, n) = solution->axes[static_cast<std::size_t>(k)].residuals;
  }
  return all;
}

TEST(Model, FitsTheCoefficientsOfEachAxis) {
  const ReadingSet set = some_set(1);
  const TableField field = test::gravity_in_table(test::sloping_gravity);
  const Eigen::MatrixXd X = test::rows_of(set, test::sloping_gravity);
  const auto solution = Model(set, true).at({.field = field});
  EXPECT_EQ(solution->shared_count(), 0);
  const Eigen::MatrixXd expected = (X.transpose() * X).ldlt().solve(X.transpose() * set.response);
  EXPECT_TRUE(solution->coefficients().isApprox(expected, 1e-12));
}

// The Jacobian of variable projection at a solution, compared with finite differences.
TEST(Model, KnowsTheChangeWithTheDirections) {
  const ReadingSet set = some_set(2);
  const Model model(set, false);
  const auto solution = model.at({.field = level_field()});
  ASSERT_EQ(solution->direction_count(), 2);
  const Eigen::Index n = set.size();
  constexpr double step = 1e-6;
  for (Eigen::Index d = 0; d < 2; ++d) {
    const Eigen::Vector2d turn = step * Eigen::Vector2d::Unit(d);
    const Eigen::VectorXd change = (residuals_at(model, model.moved(*solution, turn)) -
                                    residuals_at(model, model.moved(*solution, -turn))) /
                                   (-2.0 * step);
    for (Eigen::Index k = 0; k < 3; ++k) {
      const AxisSolution& axis = solution->axes[static_cast<std::size_t>(k)];
      EXPECT_LT((change.segment(n * k, n) - axis.projected.col(d)).norm(),
                0.02 * axis.projected.col(d).norm())
          << k << d;
    }
  }
}

TEST(Model, FindsTheDirection) {
  const ReadingSet set = some_set(3);
  const Model model(set, false);
  const auto found = model.solved(model.at(model.start(level_field())), ones(set));
  ASSERT_TRUE(found.converged);
  EXPECT_LE(found.rounds, 8);
  const Eigen::Vector3d off = found.state->field().vector(0) - test::sloping_gravity;
  EXPECT_LT(off.norm(), 5.0 * model_noise);
  // At the solution the gradient of the sum of squares by the direction is 0.
  for (const AxisSolution& axis : found.state->axes) {
    EXPECT_LT((axis.design->basis().transpose() * axis.residuals).norm(), 1e-10);
  }
  EXPECT_LT(found.state->sums.gradient.rowwise().sum().norm(), 1e-10);
}

TEST(Model, LeavesOutReadingsOfWeightZero) {
  ReadingSet set = some_set(4);
  set.response(5, 1) += 1.0;
  Eigen::MatrixXd weights = set.weights;
  weights.row(5).setZero();
  const Model model(set, false, weights);
  const auto found = model.solved(model.at(model.start(level_field())), ones(set));
  ASSERT_TRUE(found.converged);
  EXPECT_LT((found.state->field().vector(0) - test::sloping_gravity).norm(), 5.0 * model_noise);
  EXPECT_LT(found.state->sums.squares(1), 30.0 * model_noise * model_noise);
}

TEST(Model, FindsTheTurnsOfMounts) {
  ReadingSet set = some_set(5);
  const Eigen::Vector3d turn(2e-3, -1e-3, 3e-3);
  for (std::size_t i = 12; i < set.readings.size(); ++i) {
    set.readings[i].mount = 2;
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d met = set.rotation_sensor_from_table[i] * test::sloping_gravity;
    set.response.row(row) +=
        (test::some_response().sensitivity * (rotation_by(turn) * met - met)).transpose();
  }
  const Model model = Model(set, false).with_free_mounts();
  const auto found = model.solved(model.at(model.start(level_field())), ones(set));
  ASSERT_TRUE(found.converged);
  const std::map<int, Eigen::Matrix3d>& mounts = found.state->place.mounts;
  ASSERT_EQ(mounts.size(), 2U);
  const Eigen::Matrix3d between = mounts.at(2) * mounts.at(1).transpose();
  EXPECT_LT((between - rotation_by(turn)).norm(), 5.0 * model_noise);
}

TEST(Model, FindsTheScaleOverTemperature) {
  ReadingSet set = some_set(6);
  const double scale = 2e-3;
  const double drift = 1e-3;
  set.temperature.order = 1;
  set.temperature.d.resize(set.size(), 3);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const double d = (i * 7) % 24 < 12 ? -10.0 : 10.0;
    set.temperature.d.row(i).setConstant(d);
    const Eigen::RowVectorXd sensed = set.response.row(i) - test::some_response().bias.transpose();
    set.response.row(i) += (drift * d + scale * d * sensed.array()).matrix();
  }
  for (const bool known : {true, false}) {
    const Model model(set, known);
    const TableField field = known ? test::gravity_in_table(test::sloping_gravity) : level_field();
    const auto found = model.solved(model.at(model.start(field)), ones(set));
    ASSERT_TRUE(found.converged);
    EXPECT_LT((found.state->place.scale.array() - scale).abs().maxCoeff(), 1e-5) << known;
    const ReadingSet fitted = *with_scales_of(set, found.state->place);
    EXPECT_NEAR(fitted.scale(0, 0), 1.0 + scale * set.temperature.d(0, 0), 1e-4);
  }
}

TEST(Model, FitsAddedColumns) {
  ReadingSet set = some_set(7);
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(set.size() * 3, 1);
  for (Eigen::Index i = 12; i < 24; ++i) {  // a step of the first axis at reading 12
    Z(i, 0) = 1.0;
    set.response(i, 0) += 0.01;
  }
  const Model model =
      Model(set, false).with([&](const TableField&, const Eigen::MatrixXd&) { return Z; });
  const auto found = model.solved(model.at(model.start(level_field())), ones(set));
  ASSERT_TRUE(found.converged);
  ASSERT_EQ(found.state->place.added.size(), 1);
  EXPECT_NEAR(found.state->place.added(0), 0.01, 5.0 * model_noise);
}

TEST(Model, NamesWhatTheReadingsLeaveOpen) {
  ReadingSet set = some_set(8, 6);
  set.response.conservativeResize(3, Eigen::NoChange);
  set.weights.conservativeResize(3, Eigen::NoChange);
  set.readings.resize(3);
  Rotations few;
  for (std::size_t i = 0; i < 3; ++i) {
    few.push_back(set.rotation_sensor_from_table[i]);
  }
  set.rotation_sensor_from_table = few;
  const Model model(set, true);
  EXPECT_THROW(static_cast<void>(model.at({.field = level_field()})), RankDeficientError);
}

// The noise of the axes at the solution is that of restricted likelihood, sigma_k^2 = RSS_k / nu_k.
TEST(Model, FindsTheNoiseOfEachAxis) {
  ReadingSet set = some_set(9);
  RandomStream random(1);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    set.response(i, 2) += 20.0 * model_noise * random.normal();
  }
  const Model model(set, false);
  const auto found = model.solved(model.at(model.start(level_field())), ones(set));
  const Eigen::VectorXd smallest = Eigen::VectorXd::Constant(3, 1e-12);
  const std::optional<AxisNoise> by_axis =
      Model::noise(*found.state, Eigen::VectorXd::Constant(3, model_noise), smallest);
  ASSERT_TRUE(by_axis.has_value());
  EXPECT_LT(by_axis->sigma(0), 2.0 * model_noise);
  EXPECT_GT(by_axis->sigma(2), 10.0 * model_noise);
  // Three axes of 24 readings less four coefficients each and two directions.
  EXPECT_NEAR(by_axis->degrees_of_freedom.sum(), 3.0 * 20.0 - 2.0, 1e-6);
  const SharedCost cost = Model::cost_of_shared(*found.state, by_axis->sigma);
  EXPECT_NEAR(cost.degrees_of_freedom.sum(), 58.0, 1e-9);
  // The directions are determined by the axes with little noise, which lose degrees of freedom.
  EXPECT_GT(cost.degrees_of_freedom(2), 19.9);
}

class FitOfRun : public testing::TestWithParam<bool> {
 protected:
  FitOfRun() {
    const Model model(set_, GetParam());
    const TableField field =
        GetParam() ? test::gravity_in_table(test::sloping_gravity) : level_field();
    solution_ = model.solved(model.at(model.start(field)), sigma_).state;
  }

  ReadingSet set_ = some_set(10);
  Eigen::VectorXd sigma_ = Eigen::Vector3d(model_noise, 2.0 * model_noise, 0.5 * model_noise);
  std::shared_ptr<const Solution> solution_;
};

TEST_P(FitOfRun, HasTheHatMatrixOfItsColumns) {
  const Fit fit(set_, solution_, sigma_);
  ASSERT_TRUE(fit.is_determined());
  const Eigen::MatrixXd J = fit.columns();
  EXPECT_EQ(J.cols(), fit.column_count());
  const Eigen::MatrixXd hat = J * (J.transpose() * J).inverse() * J.transpose();
  const Eigen::MatrixXd leverage = fit.leverage();
  for (Eigen::Index i = 0; i < fit.readings(); i += 5) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      EXPECT_NEAR(leverage(i, k), hat(fit.row_of(i, k), fit.row_of(i, k)), 1e-9);
      EXPECT_NEAR(fit.hat(k, i, 1, 7), hat(fit.row_of(i, k), fit.row_of(7, 1)), 1e-9);
    }
  }
  EXPECT_NEAR(leverage.sum(), static_cast<double>(fit.column_count()), 1e-9);
  double free = 0.0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    EXPECT_NEAR(fit.degrees_of_freedom_of(k), 24.0 - leverage.col(k).sum(), 1e-9);
    free += fit.degrees_of_freedom_of(k);
  }
  EXPECT_NEAR(free, fit.degrees_of_freedom(), 1e-9);
  EXPECT_TRUE(fit.information().isApprox(J.transpose() * J, 1e-12));
  EXPECT_LT((J.transpose() * fit.residuals()).norm(), 1e-6 * J.norm());
}

TEST_P(FitOfRun, TakesUpChangesAsLeastSquaresDo) {
  const Fit fit(set_, solution_, sigma_);
  const Eigen::MatrixXd J = fit.columns();
  RandomStream random(3);
  Eigen::MatrixXd changes(J.rows(), 2);
  for (double& one : changes.reshaped()) {
    one = random.normal();
  }
  EXPECT_TRUE(fit.solution_change(changes).isApprox(
      (J.transpose() * J).ldlt().solve(J.transpose() * changes), 1e-8));
  const Eigen::MatrixXd C = (J.transpose() * J).inverse();
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Fit::RootOfAxis root = fit.root_of_axis(k);
    const Eigen::MatrixXd own =
        root.own * root.own.transpose() + root.shared * root.shared.transpose();
    EXPECT_TRUE(own.isApprox(C.block(fit.column_of(k, 0), fit.column_of(k, 0), 4, 4), 1e-7));
  }
  EXPECT_TRUE(
      fit.covariance_of_shared().isApprox(C.bottomRightCorner(fit.shared(), fit.shared()), 1e-7));
}

// The rows of Z are ordered by axis, as those of a hypothesis.
TEST_P(FitOfRun, ProjectsColumnsOnItsBasis) {
  const Fit fit(set_, solution_, sigma_);
  const Eigen::Index n = fit.readings();
  RandomStream random(4);
  Eigen::MatrixXd Z(n * 3, 2);
  for (double& one : Z.reshaped()) {
    one = random.normal();
  }
  Eigen::MatrixXd by_reading(n * 3, 2);
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(fit.column_count(), 2);
  for (Eigen::Index k = 0; k < 3; ++k) {
    for (Eigen::Index i = 0; i < n; ++i) {
      by_reading.row(fit.row_of(i, k)) = Z.row(n * k + i);
      fit.add_in_basis(k, i, Z.row(n * k + i), sums);
    }
  }
  const Eigen::MatrixXd products = fit.in_basis(Z);
  EXPECT_TRUE(products.isApprox(sums, 1e-9));
  const Eigen::MatrixXd J = fit.columns();
  const Eigen::MatrixXd hat = J * (J.transpose() * J).inverse() * J.transpose();
  EXPECT_TRUE(
      (products.transpose() * products).isApprox(by_reading.transpose() * hat * by_reading, 1e-7));
}

INSTANTIATE_TEST_SUITE_P(Directions, FitOfRun, testing::Bool(), [](const auto& known) {
  return known.param ? "known" : "fitted";
});

TEST(WiderIntervals, NeverMakesOneShorter) {
  Estimate estimate;
  estimate.response.bias = Eigen::Vector2d::Zero();
  estimate.statistics.covariance = Eigen::Vector2d(4.0, 1.0).asDiagonal();
  estimate.statistics.interval_95 = Eigen::Vector2d(5.0, 2.5);
  estimate.statistics.interval_dof = Eigen::Vector2d(8.0, 8.0);
  WiderIntervals wider("cause", estimate);
  wider.widen(0, 1.0, 100.0);
  EXPECT_EQ(estimate.statistics.interval_95(0), 5.0);
  wider.widen(1, 9.0, 4.0);
  EXPECT_NEAR(estimate.statistics.interval_95(1), 3.0 * 2.776, 1e-2);
  EXPECT_NEAR(estimate.statistics.covariance(1, 1), 9.0, 1e-12);
  EXPECT_TRUE(wider.put());
  ASSERT_EQ(estimate.statistics.components.size(), 1U);
  EXPECT_EQ(estimate.statistics.components.front().name, "cause");
  EXPECT_EQ(estimate.statistics.components.front().degrees_of_freedom, 4.0);
}

TEST(WiderIntervals, AddsNoComponentForNothing) {
  Estimate estimate;
  estimate.response.bias = Eigen::Vector2d::Zero();
  estimate.statistics.covariance = Eigen::Vector2d(4.0, 1.0).asDiagonal();
  estimate.statistics.interval_95 = Eigen::Vector2d(5.0, 2.5);
  estimate.statistics.interval_dof = Eigen::Vector2d(8.0, 8.0);
  WiderIntervals wider("cause", estimate);
  wider.widen(0, 0.1, 100.0);
  EXPECT_FALSE(wider.put());
  EXPECT_TRUE(estimate.statistics.components.empty());
}

}  // namespace
}  // namespace axiscal
