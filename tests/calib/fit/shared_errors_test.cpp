// SPDX-License-Identifier: Apache-2.0
// weigh_shared_errors(), compared with explicit generalised least squares, and make_budget() with
// inputs that are only stated.
#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/generalized_fit.hpp"
#include "calib/fit/uncertainty_sources.hpp"
#include "calib/record/parameter_names.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

// The slope of the table has a stated uncertainty of 1e-3 and is larger. With one axis restricted
// likelihood has one equation, tr P = y' P P y.
TEST(WeighSharedErrors, IsGeneralizedLeastSquares) {
  const Eigen::Vector3d in_table = Eigen::Vector3d::UnitZ();
  const LinearResponse truth{.bias = Eigen::VectorXd::Constant(1, 0.1),
                             .sensitivity = Eigen::RowVector3d(0.3, -0.2, 2.0)};
  const double u = 1e-3;
  const TableField as_given = test::gravity_in_table(in_table);
  const TableField as_it_is = test::gravity_in_table(Eigen::Vector3d(1.2e-3, -0.7e-3, 1.0));
  ReadingSet set = test::labelled_set(truth, as_it_is, standard_design(24), 2e-4, 11);
  set.field = as_given;
  Experiment experiment;
  experiment.fit.method = Method::known;
  experiment.stated.slope_u = u;
  Estimate estimate = estimate_known(set, as_given);
  fill_intervals(estimate.statistics);
  SolvedReadings state(set, true);
  const std::vector<UncertaintySource> sources =
      weigh_shared_errors(experiment, state, Method::known, estimate);
  ASSERT_EQ(sources.size(), 1U);
  EXPECT_EQ(sources.front().name, "levelness");

  const Eigen::MatrixXd X = test::rows_of(set, in_table);
  const Eigen::RowVector3d S = estimate.response.sensitivity.row(0);
  Eigen::MatrixXd H(set.size(), 2);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const Eigen::Matrix3d& R = set.rotation_sensor_from_table[static_cast<std::size_t>(i)];
    for (int j = 0; j < 2; ++j) {
      // A slope rotates the field about the table's x and y axes.
      H(i, j) = S.dot(R * (u * Eigen::Vector3d(Eigen::Vector3d::Unit(j)).cross(in_table)));
    }
  }
  const double s = estimate.statistics.residual_sd(0);
  const Eigen::MatrixXd V =
      s * s * Eigen::MatrixXd::Identity(set.size(), set.size()) + H * H.transpose();
  const Eigen::MatrixXd W = V.inverse();
  const Eigen::MatrixXd C = (X.transpose() * W * X).inverse();
  const Eigen::VectorXd b = C * (X.transpose() * W * set.response.col(0));
  EXPECT_NEAR(estimate.response.bias(0), b(0), 1e-9);
  EXPECT_MATRIX_NEAR(S.transpose(), b.tail<3>(), 1e-9);
  EXPECT_MATRIX_NEAR(estimate.statistics.covariance.diagonal(), C.diagonal(),
                     1e-3 * C.diagonal().maxCoeff());
  const Eigen::MatrixXd P = W - W * X * C * X.transpose() * W;
  const Eigen::VectorXd Py = P * set.response.col(0);
  EXPECT_NEAR(Py.squaredNorm(), P.trace(), 1e-3 * P.trace());
}

// Six faces with one fence face each do not determine the field's direction together with b and S.
// solution_change() still explains any change in the span of the columns.
TEST(Fit, TakesUpWhatItsColumnsSpan) {
  const LinearResponse truth{.bias = Eigen::VectorXd::Constant(1, 0.1),
                             .sensitivity = Eigen::RowVector3d(0.3, -0.2, 2.0)};
  const TableField field = test::gravity_in_table(Eigen::Vector3d::UnitZ());
  std::vector<DesignEntry> six;
  for (const DesignEntry& entry : standard_design(12)) {
    if (six.empty() || six.back().point.rest() != entry.point.rest()) {
      six.push_back(entry);
    }
  }
  for (const bool all : {true, false}) {
    ReadingSet set = test::labelled_set(truth, field, all ? standard_design(12) : six, 1e-4, 3);
    set.field = field;
    SolvedReadings state(set, false);
    const Fit run(state, field, Eigen::VectorXd::Ones(1));
    EXPECT_EQ(run.is_determined(), all);
    const Eigen::MatrixXd& J = run.columns();
    Eigen::MatrixXd changes(J.rows(), 2);
    changes << J * Eigen::VectorXd::LinSpaced(J.cols(), -1.0, 2.0), J.col(J.cols() - 1);
    EXPECT_MATRIX_NEAR(J * run.solution_change(changes), changes, 1e-9);
  }
}

// Compared with the whole Jacobian: its hat matrix is K K^T, and the variances are those of the
// normal equations.
TEST(Fit, HasBasesOfItsColumnsAndTheirRoots) {
  LinearResponse truth{.bias = Eigen::Vector3d(0.1, -0.2, 0.3),
                       .sensitivity = 2.0 * Eigen::Matrix3d::Identity()};
  truth.sensitivity(0, 1) = 0.05;
  const TableField field = test::gravity_in_table(Eigen::Vector3d(3e-3, -2e-3, 1.0).normalized());
  for (const bool known : {true, false}) {
    ReadingSet set = test::labelled_set(truth, field, standard_design(12), 1e-4, 3);
    set.field = field;
    set.weights(4, 1) = 0.0;
    set.weights.col(2).head(6).setConstant(0.5);
    SolvedReadings state(set, known);
    const Fit run(state, field, Eigen::Vector3d(1e-4, 2e-4, 3e-4));
    ASSERT_TRUE(run.is_determined());
    const Eigen::Index q = run.column_count();
    ASSERT_EQ(q, known ? 12 : 14);
    const Eigen::MatrixXd J = run.columns();
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(run.row_count(), q);
    Eigen::MatrixXd by = Eigen::MatrixXd::Random(run.readings(), run.axes());
    Eigen::MatrixXd combined = Eigen::MatrixXd::Zero(run.readings(), run.row_count());
    for (Eigen::Index k = 0; k < run.axes(); ++k) {
      K(run.rows_of_axis(k), Eigen::seqN(run.column_of(k, 0), 4)) = run.basis_of_axis(k);
      K(run.rows_of_axis(k), Eigen::lastN(run.shared())) = run.shared_basis_of_axis(k);
      for (Eigen::Index i = 0; i < run.readings(); ++i) {
        combined(i, run.row_of(i, k)) = by(i, k);
      }
    }
    EXPECT_MATRIX_NEAR(K.transpose() * K, Eigen::MatrixXd::Identity(q, q), 1e-9);
    const Eigen::MatrixXd C = (J.transpose() * J).inverse();
    const Eigen::MatrixXd H = J * C * J.transpose();
    EXPECT_MATRIX_NEAR(K * K.transpose(), H, 1e-8);
    const Eigen::MatrixXd B = run.combined_basis(by);
    EXPECT_MATRIX_NEAR(B * B.transpose(), combined * H * combined.transpose(), 1e-8);
    for (Eigen::Index k = 0; k < run.axes(); ++k) {
      const Fit::RootOfAxis root = run.root_of_axis(k);
      for (Eigen::Index j = 0; j < 4; ++j) {
        const Eigen::Index c = run.column_of(k, j);
        EXPECT_NEAR((root.own.row(j).squaredNorm() + root.shared.row(j).squaredNorm()) / C(c, c),
                    1.0, 1e-8);
        Eigen::VectorXd all = K.rightCols(run.shared()) * root.shared.row(j).transpose();
        all += K.middleCols(run.column_of(k, 0), 4) * root.own.row(j).transpose();
        EXPECT_MATRIX_NEAR(all, J * C.col(c), 1e-8 * (J * C.col(c)).norm());
      }
    }
  }
}

// A one-sided axis that never responds is reported as dead. Its sensitivity is not reported as
// undetermined.
TEST(EstimateKnown, SaysThatAnAxisIsDeadBeforeWhatItLeavesOpen) {
  const TableField field = test::gravity_in_table(test::sloping_gravity);
  ReadingSet set = test::labelled_set(test::some_response(), field, standard_design(12), 1e-4, 3);
  set.field = field;
  set.response.col(2).setConstant(5.0);
  set.visible = {AxisMask::Constant(12, 3, true)};
  set.visible.front().col(2).setConstant(false);
  EXPECT_THAT([&] { static_cast<void>(estimate_known(set, field)); },
              testing::ThrowsMessage<RefusedError>(testing::HasSubstr("axis z does not respond")));
}

TEST(MakeBudget, ScalesWithTheFieldAndTurnsWithTheMount) {
  const double F = 9.81;
  Calibration calibration;
  calibration.sensor.instrument.kind = "accelerometer";
  calibration.sensor.field.kind = "gravity";
  calibration.sensor.field.unit = "m/s^2";
  calibration.sensor.field.magnitude = F;
  calibration.sensor.field.magnitude_u = 1e-3;
  Eigen::Matrix3d S;
  S << 0.2, 0.01, 0.0, -0.02, 0.21, 0.005, 0.0, 0.004, 0.19;
  calibration.sensor.response = {Eigen::Vector3d::Zero(), S};
  FitStatistics& statistics = calibration.fit.statistics.emplace();
  statistics.parameter_names = parameter_names({"x", "y", "z"});
  statistics.covariance = Eigen::MatrixXd::Zero(12, 12);
  statistics.residual_sd = Eigen::Vector3d::Zero();
  const double turn = 2e-4;
  Experiment experiment;
  experiment.slot = "a";
  experiment.positioner = Positioner().with_mounts({Mount{.slot = "a", .repeatability_rad = turn}});
  const UncertaintyBudget budget = make_budget(experiment, {}, calibration, {}, {});
  ASSERT_EQ(budget.sources.size(), 3U);  // fit, field magnitude, mount

  // The magnitude changes all sensitivities by the factor u / F, and no bias.
  Eigen::VectorXd by_field = Eigen::VectorXd::Zero(12);
  Eigen::MatrixXd by_mount = Eigen::MatrixXd::Zero(12, 12);
  for (int k = 0; k < 3; ++k) {
    by_field.segment<3>(4 * k + 1) = 1e-3 / F * S.row(k).transpose();
  }
  for (int j = 0; j < 3; ++j) {
    // v = S R f with R = I + [w x], so S changes by S [w x].
    const Eigen::Matrix3d change = turn * S * cross_matrix(Eigen::Vector3d::Unit(j));
    Eigen::VectorXd all = Eigen::VectorXd::Zero(12);
    for (int k = 0; k < 3; ++k) {
      all.segment<3>(4 * k + 1) = change.row(k).transpose();
    }
    by_mount += all * all.transpose();
  }
  EXPECT_MATRIX_NEAR(budget.sources[1].covariance, by_field * by_field.transpose(), 1e-18);
  EXPECT_EQ(budget.sources[2].name, "mount");
  EXPECT_MATRIX_NEAR(budget.sources[2].covariance, by_mount, 1e-18);
}

}  // namespace
}  // namespace axiscal
