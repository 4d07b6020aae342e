// SPDX-License-Identifier: Apache-2.0
// The derivatives of readings, compared with finite differences, and the polar form, compared with
// the linear fit.
#include "calib/fit/response_system.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "axiscal/calib/polar_fit.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

ReadingSet set_for_changes(int points = 12) {
  return test::labelled_set(test::some_response(), test::gravity_in_table(test::sloping_gravity),
                            standard_design(points), 1e-4, 1);
}

// Changes of the fields with each shared unknown, by central differences of the field.
Eigen::MatrixXd changes_by_differences(const ReadingSet& set,
                                       const TableField& field,
                                       Eigen::Index axis) {
  constexpr double step = 1e-6;
  const auto tangents = field.tangents();
  Eigen::Index count = 0;
  for (const auto& own : tangents) {
    count += own.cols();
  }
  Eigen::MatrixXd changes(3 * set.size(), count);
  for (Eigen::Index s = 0; s < count; ++s) {
    const TableField plus = field.moved(tangents, step * Eigen::VectorXd::Unit(count, s));
    const TableField minus = field.moved(tangents, -step * Eigen::VectorXd::Unit(count, s));
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const Eigen::Matrix3d& R = set.rotation_sensor_from_table[static_cast<std::size_t>(i)];
      changes.block<3, 1>(3 * i, s) =
          R * (set.seen_in_table(axis, i, plus) - set.seen_in_table(axis, i, minus)) / (2.0 * step);
    }
  }
  return changes;
}

TEST(ChangesWithDirections, AreTheDerivativesOfTheFieldInTheSensor) {
  const ReadingSet set = set_for_changes();
  const TableField field = test::gravity_in_table(Eigen::Vector3d(0.3, -0.5, 0.7));
  const FieldChanges changes = field_direction_derivatives(set, field, field.tangents());
  ASSERT_EQ(changes.cols(), 2);
  EXPECT_MATRIX_NEAR(changes, changes_by_differences(set, field, 0), 1e-9);
  // A change of the direction moves the field across itself. The change has the length of the
  // field.
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const Eigen::Vector3d met =
        set.rotation_sensor_from_table[static_cast<std::size_t>(i)] * field.vector(0);
    const Eigen::MatrixXd own = changes.middleRows<3>(3 * i);
    EXPECT_LT((met.transpose() * own).norm(), 1e-12);
    EXPECT_MATRIX_NEAR(Eigen::MatrixXd(own.transpose() * own),
                       met.squaredNorm() * Eigen::Matrix2d::Identity(), 1e-12);
  }
}

TEST(ChangesWithDirections, BelongToTheTiltOfEachBlock) {
  ReadingSet set = set_for_changes();
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    set.readings[i].block = i % 2 == 0 ? 3 : 8;
  }
  const TableField field = set.field.tilted_by_block({3, 8}).with(
      {Eigen::Vector3d(0.1, 0.0, 1.0), Eigen::Vector3d(0.0, -0.2, 0.9)});
  set.field = field;
  const FieldChanges changes = field_direction_derivatives(set, field, field.tangents());
  ASSERT_EQ(changes.cols(), 4);
  EXPECT_MATRIX_NEAR(changes, changes_by_differences(set, field, 0), 1e-9);
  EXPECT_EQ(changes.topRightCorner(3, 2).norm(), 0.0);
  EXPECT_GT(changes.topLeftCorner(3, 2).norm(), 0.5);
  EXPECT_EQ(changes.block(3, 0, 3, 2).norm(), 0.0);
}

// The field of a lamp of known strength and daylight of unknown strength.
TableField lamp_and_daylight() {
  FieldDescription lamp{.kind = "lamp", .name = "lamp", .unit = "1", .magnitude = 2.0};
  FieldDescription daylight{.kind = "daylight", .unit = "1", .magnitude = 0.4};
  daylight.set_by_level = false;
  daylight.free_length = true;
  return TableField({lamp, daylight})
      .with({Eigen::Vector3d(0.0, 1.2, 1.6), Eigen::Vector3d(0.3, 0.1, -0.2)});
}

ReadingSet set_under_two_lights() {
  ReadingSet set = set_for_changes(24);
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    set.readings[i].level = i % 3 == 0 ? 0.0 : 0.5 * static_cast<double>(i % 3);
  }
  set.field = lamp_and_daylight();
  return set;
}

TEST(ChangesWithDirections, OfASumHaveThreeColumnsForAPartOfUnknownLength) {
  const ReadingSet set = set_under_two_lights();
  const FieldChanges changes = field_direction_derivatives(set, set.field, set.field.tangents());
  ASSERT_EQ(changes.cols(), 5);
  EXPECT_MATRIX_NEAR(changes, changes_by_differences(set, set.field, 0), 1e-8);
  // Reading 0 has the level 0, so the direction of the lamp does not change it.
  EXPECT_EQ(changes.topLeftCorner(3, 2).norm(), 0.0);
  EXPECT_NEAR(changes.topRightCorner(3, 3).norm(), 2.0 * std::sqrt(3.0), 1e-12);
}

TEST(ChangesWithDirections, LeaveOutTheLightsThatAnAxisDoesNotSee) {
  ReadingSet set = set_under_two_lights();
  const AxisMask all = AxisMask::Constant(set.size(), 3, true);
  set.visible = {all, all};
  set.visible[0](1, 2) = false;
  set.visible[1](4, 2) = false;
  for (const Eigen::Index axis : {0, 2}) {
    const FieldChanges changes =
        field_direction_derivatives(set, set.field, set.field.tangents(), axis);
    EXPECT_MATRIX_NEAR(changes, changes_by_differences(set, set.field, axis), 1e-8);
    EXPECT_EQ(changes.block(3, 0, 3, 2).norm() == 0.0, axis == 2);
    EXPECT_EQ(changes.block(12, 2, 3, 3).norm() == 0.0, axis == 2);
  }
}

TEST(ChangesWithDirections, FollowAFieldThatMoves) {
  ReadingSet set = set_for_changes();
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const double part = static_cast<double>(i) / 10.0;
    set.field_then.emplace_back((1.0 + part) * rotation_by(Eigen::Vector3d(0.0, part, -part)));
  }
  const TableField field = test::gravity_in_table(Eigen::Vector3d(0.3, -0.5, 0.7));
  const FieldChanges changes = field_direction_derivatives(set, field, field.tangents());
  EXPECT_MATRIX_NEAR(changes, changes_by_differences(set, field, 0), 1e-8);
}

TEST(ResponseChanges, AreTheDerivativesOfReadingsOverTemperature) {
  ReadingSet set = set_for_changes();
  set.temperature.order = 2;
  set.temperature.d = Eigen::VectorXd::LinSpaced(set.size(), -20.0, 30.0).replicate(1, 3);
  set.temperature.scale.resize(3, 2);
  set.temperature.scale << 1e-3, 2e-5, -2e-3, 1e-5, 3e-3, -4e-5;
  const TableField field = test::gravity_in_table(Eigen::Vector3d(0.3, -0.5, 0.7));
  const FieldChanges changes = field_direction_derivatives(set, field, field.tangents());
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::RowVector3d S = test::some_response().sensitivity.row(k);
    const Eigen::MatrixXd rows = response_changes(set, k, S, changes);
    ASSERT_EQ(rows.rows(), set.size());
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const double d = set.temperature.d(i, k);
      const double scale =
          1.0 + set.temperature.scale(k, 0) * d + set.temperature.scale(k, 1) * d * d;
      const Eigen::RowVectorXd expected = scale * S * changes.middleRows<3>(3 * i);
      EXPECT_MATRIX_NEAR(rows.row(i), expected, 1e-12);
    }
  }
}

// Least squares of the stacked system give the coefficients from which the readings were computed.
TEST(StackedByAxis, SharesTheLastColumnsOnly) {
  RandomStream random(7);
  std::vector<Eigen::MatrixXd> own(2, Eigen::MatrixXd(9, 3));
  std::vector<Eigen::MatrixXd> shared(2, Eigen::MatrixXd(9, 2));
  for (std::size_t k = 0; k < 2; ++k) {
    for (double& one : own[k].reshaped()) {
      one = random.normal();
    }
    for (double& one : shared[k].reshaped()) {
      one = random.normal();
    }
  }
  const Eigen::MatrixXd J = stacked_by_axis(own, shared);
  ASSERT_EQ(J.rows(), 18);
  ASSERT_EQ(J.cols(), 8);
  const Eigen::VectorXd truth = random.normals<8>();
  Eigen::VectorXd v(18);
  v << own[0] * truth.head<3>() + shared[0] * truth.tail<2>(),
      own[1] * truth.segment<3>(3) + shared[1] * truth.tail<2>();
  EXPECT_MATRIX_NEAR(Eigen::VectorXd(J.colPivHouseholderQr().solve(v)), truth, 1e-12);
  EXPECT_EQ(J.topRows(9).middleCols(3, 3).norm(), 0.0);
  EXPECT_EQ(J.bottomRows(9).leftCols(3).norm(), 0.0);
}

// ---- the polar form ----

// Fields of length 1 in random directions.
Eigen::MatrixX3d random_fields(Eigen::Index n, std::uint64_t seed) {
  RandomStream random(seed);
  Eigen::MatrixX3d fields(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    fields.row(i) = random.normals<3>().normalized().transpose();
  }
  return fields;
}

// Bias and row of S of one axis, by QR.
Eigen::Vector4d linear_row(const Eigen::MatrixX3d& fields, const Eigen::VectorXd& v) {
  Eigen::MatrixXd X(fields.rows(), 4);
  X << Eigen::VectorXd::Ones(fields.rows()), fields;
  return X.colPivHouseholderQr().solve(v);
}

TEST(FitPolarForm, AgreesWithTheLinearRegression) {
  for (const AxisConvention convention :
       {AxisConvention::forward_left_up, AxisConvention::forward_right_down}) {
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::MatrixX3d fields = random_fields(20, 3 + static_cast<std::uint64_t>(axis));
      RandomStream random(static_cast<std::uint64_t>(axis) + 10);
      Eigen::Vector3d row(0.05, -0.08, 0.06);
      row(axis) = 2.5;
      Eigen::VectorXd v = fields * row + Eigen::VectorXd::Constant(20, 0.7);
      for (double& value : v) {
        value += 0.01 * random.normal();
      }
      const PolarFit fit = fit_polar_form(fields, v, axis, convention);
      ASSERT_TRUE(fit.converged);
      const Eigen::Vector4d linear = linear_row(fields, v);
      EXPECT_NEAR(fit.bias, linear(0), 1e-9);
      EXPECT_MATRIX_NEAR(sensitivity_from_polar(fit.form, axis, convention), linear.tail<3>(),
                         1e-8);
      const double rss =
          (v - fields * linear.tail<3>() - Eigen::VectorXd::Constant(20, linear(0))).squaredNorm();
      EXPECT_NEAR(fit.residual_sd, std::sqrt(rss / 16.0), 1e-9);
      EXPECT_GE(fit.form.coning_angle_rad, 0.0);
      EXPECT_LE(fit.form.coning_angle_rad, 0.5 * std::numbers::pi);
    }
  }
}

// Coning angle and azimuth from their definition in forward-right-down. The coning angle is that to
// the nominal axis.
TEST(FitPolarForm, StatesConeAndAzimuth) {
  const Eigen::MatrixX3d fields = random_fields(12, 4);
  const double cone = 0.02;
  const double azimuth = 2.0;
  const Eigen::Vector3d row =
      3.0 * Eigen::Vector3d(std::sin(cone) * std::sin(azimuth), std::cos(cone),
                            std::sin(cone) * std::cos(azimuth));
  const PolarFit fit = fit_polar_form(fields, fields * row, 1, AxisConvention::forward_right_down);
  EXPECT_NEAR(fit.form.sensitivity, 3.0, 1e-9);
  EXPECT_NEAR(fit.form.coning_angle_rad, cone, 1e-9);
  EXPECT_NEAR(fit.form.azimuth_rad, azimuth, 1e-7);
  EXPECT_NEAR(fit.bias, 0.0, 1e-9);
}

TEST(FitPolarForm, KnowsNoScatterOfFourReadings) {
  const Eigen::MatrixX3d fields = random_fields(4, 5);
  const Eigen::VectorXd v = fields * Eigen::Vector3d(2.0, 0.1, 0.1);
  EXPECT_TRUE(
      std::isnan(fit_polar_form(fields, v, 0, AxisConvention::forward_left_up).residual_sd));
}

TEST(FitPolarForm, RefusesWrongSizes) {
  const Eigen::MatrixX3d fields = random_fields(5, 6);
  for (const Eigen::Index readings : {3, 4}) {
    const std::string complaint = test::complaint_of<DomainError>([&] {
      static_cast<void>(fit_polar_form(fields.topRows(readings == 3 ? 3 : 5),
                                       Eigen::VectorXd::Zero(readings), 0,
                                       AxisConvention::forward_left_up));
    });
    EXPECT_THAT(complaint, testing::HasSubstr("four readings or more, each with its field"));
  }
}

}  // namespace
}  // namespace axiscal
