// SPDX-License-Identifier: Apache-2.0
// Fields that span a line or a plane: method transfer, compared with QR in those directions.
#include "calib/fit/transfer.hpp"

#include <cmath>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/record/parameter_names.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

constexpr double transfer_noise = 1e-3;

// Readings with stated fields in the span of `directions`, plus a constant field.
ReadingSet set_along(const Eigen::Matrix3Xd& directions,
                     Eigen::Index n,
                     const Eigen::Vector3d& constant = Eigen::Vector3d::Zero(),
                     std::uint64_t seed = 1) {
  RandomStream random(seed);
  const LinearResponse truth = test::some_response();
  ReadingSet set;
  set.axes = {"x", "y", "z"};
  set.nominal = {0, 1, 2};
  set.response.resize(n, 3);
  set.weights = Eigen::MatrixXd::Ones(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    Eigen::VectorXd amounts(directions.cols());
    for (double& one : amounts) {
      one = random.normal();
    }
    Reading reading{.run = static_cast<int>(i) + 1};
    const Eigen::Vector3d field = constant + directions * amounts;
    reading.field_in_sensor = field;
    set.readings.push_back(reading);
    set.response.row(i) = (truth.at(field) + transfer_noise * random.normals<3>()).transpose();
  }
  return set;
}

Eigen::MatrixXd design_by_fields(const ReadingSet& set) {
  return field_design(set, TableField());
}

Eigen::Matrix3Xd directions_seen_by(const ReadingSet& set) {
  return seen_directions(set, TableField(), design_by_fields(set));
}

Eigen::Matrix3Xd directions_of(std::initializer_list<Eigen::Vector3d> all) {
  Eigen::Matrix3Xd matrix(3, static_cast<Eigen::Index>(all.size()));
  Eigen::Index at = 0;
  for (const Eigen::Vector3d& one : all) {
    matrix.col(at++) = one;
  }
  return matrix;
}

const Eigen::Vector3d oblique_line = Eigen::Vector3d(1.0, 2.0, -2.0) / 3.0;
const Eigen::Vector3d across_line = Eigen::Vector3d(2.0, 1.0, 2.0) / 3.0;

void expect_one_span(const Eigen::Matrix3Xd& found, const Eigen::Matrix3Xd& expected) {
  ASSERT_EQ(found.cols(), expected.cols());
  EXPECT_MATRIX_NEAR(Eigen::MatrixXd(found.transpose() * found),
                     Eigen::MatrixXd::Identity(found.cols(), found.cols()), 1e-12);
  EXPECT_MATRIX_NEAR(Eigen::MatrixXd(found * found.transpose()),
                     Eigen::MatrixXd(expected * expected.transpose()), 1e-9);
}

TEST(SeenDirections, AreTheLineOrPlaneOfTheFields) {
  expect_one_span(directions_seen_by(set_along(directions_of({oblique_line}), 10)),
                  directions_of({oblique_line}));
  const Eigen::Matrix3Xd plane = directions_of({oblique_line, across_line});
  expect_one_span(directions_seen_by(set_along(plane, 10)), plane);
  EXPECT_EQ(directions_seen_by(set_along(Eigen::Matrix3d::Identity(), 10)).cols(), 0);
}

TEST(SeenDirections, AreTheSensorsAxesIfTheySpanThem) {
  const Eigen::Matrix3Xd turned =
      directions_of({Eigen::Vector3d(0.6, 0.0, 0.8), Eigen::Vector3d(-0.8, 0.0, 0.6)});
  const Eigen::Matrix3Xd seen = directions_seen_by(set_along(turned, 10));
  EXPECT_MATRIX_NEAR(seen, directions_of({Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ()}),
                     0.0);
}

// If the fields lie on a cone, the component along its axis is constant and becomes a part of the
// bias.
TEST(SeenDirections, LeaveAConstantComponentToTheBias) {
  const Eigen::Matrix3Xd plane =
      directions_of({Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()});
  const Eigen::Vector3d along(0.0, 0.0, 5.0);
  expect_one_span(directions_seen_by(set_along(plane, 10, along)), plane);
}

TEST(SeenDirections, AreJudgedByTheReadingsThatCount) {
  ReadingSet set = set_along(directions_of({oblique_line}), 10);
  set.readings[4].field_in_sensor = Eigen::Vector3d(3.0, -1.0, 2.0);
  EXPECT_EQ(directions_seen_by(set).cols(), 2);
  set.weights.row(4).setZero();
  expect_one_span(directions_seen_by(set), directions_of({oblique_line}));
}

TEST(SeenDirections, AreNoneIfTheFieldStays) {
  EXPECT_EQ(directions_seen_by(set_along(Eigen::Matrix3Xd::Zero(3, 1), 10, oblique_line)).cols(),
            0);
}

// A cube that lay on two faces can be laid on other faces, and the error names them. This is not a
// transfer.
TEST(SeenDirections, AreNoneForACubeWithFacesLeft) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const ReadingSet set = test::labelled_set(
      test::some_response(), test::gravity_in_table(up),
      {{.point = {Face::minus_z, Face::plus_x}}, {.point = {Face::plus_z, Face::plus_x}}}, 0.0, 1);
  const Eigen::MatrixXd design = test::rows_of(set, up);
  EXPECT_EQ(seen_directions(set, test::gravity_in_table(up), design).cols(), 0);
  // One axis whose fields are along its own direction is a transfer.
  ReadingSet one = set;
  one.response = set.response.col(2).eval();
  one.weights = Eigen::MatrixXd::Ones(2, 1);
  one.axes = {"z"};
  one.nominal = {2};
  EXPECT_MATRIX_NEAR(seen_directions(one, test::gravity_in_table(up), design), directions_of({up}),
                     0.0);
}

TEST(MeanLengthOfFields, LeavesOutThoseAtRest) {
  Eigen::MatrixXd design(4, 4);
  design << 1.0, 3.0, 4.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0;
  EXPECT_NEAR(mean_length_of_fields(design), 3.0, 1e-15);
  design.rightCols<3>().setZero();
  EXPECT_EQ(mean_length_of_fields(design), 0.0);
}

TEST(EstimateTransfer, IsTheRegressionAlongTheDirections) {
  const Eigen::Matrix3Xd plane = directions_of({oblique_line, across_line});
  const ReadingSet set = set_along(plane, 15, Eigen::Vector3d::Zero(), 2);
  const Eigen::MatrixXd design = design_by_fields(set);
  const Estimate estimate = estimate_transfer(set, design, plane);
  Eigen::MatrixXd X(15, 3);
  X << Eigen::VectorXd::Ones(15), design.rightCols<3>() * plane;
  const Eigen::MatrixXd C = (X.transpose() * X).inverse();
  Eigen::MatrixXd map = Eigen::MatrixXd::Zero(4, 3);
  map(0, 0) = 1.0;
  map.bottomRightCorner<3, 2>() = plane;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Vector3d x = X.colPivHouseholderQr().solve(set.response.col(k));
    const double variance = (set.response.col(k) - X * x).squaredNorm() / 12.0;
    EXPECT_NEAR(estimate.response.bias(k), x(0), 1e-12);
    EXPECT_MATRIX_NEAR(Eigen::Vector3d(estimate.response.sensitivity.row(k)),
                       Eigen::Vector3d(plane * x.tail<2>()), 1e-12);
    EXPECT_NEAR(estimate.statistics.residual_sd(k), std::sqrt(variance), 1e-12);
    EXPECT_EQ(estimate.statistics.degrees_of_freedom(k), 12.0);
    EXPECT_MATRIX_NEAR(estimate.statistics.covariance.block(4 * k, 4 * k, 4, 4),
                       variance * map * C * map.transpose(), 1e-12);
  }
  // The sensitivity across the plane is 0.
  const Eigen::Vector3d normal = oblique_line.cross(across_line);
  EXPECT_LT((estimate.response.sensitivity * normal).norm(), 1e-12);
  EXPECT_FALSE(estimate.curvature.has_value());
}

TEST(EstimateTransfer, DoesNotDependOnTheBasisOfThePlane) {
  const ReadingSet set = set_along(directions_of({oblique_line, across_line}), 15);
  const double angle = 0.7;
  const Eigen::Matrix3Xd turned =
      directions_of({std::cos(angle) * oblique_line + std::sin(angle) * across_line,
                     -std::sin(angle) * oblique_line + std::cos(angle) * across_line});
  const Estimate a =
      estimate_transfer(set, design_by_fields(set), directions_of({oblique_line, across_line}));
  const Estimate b = estimate_transfer(set, design_by_fields(set), turned);
  EXPECT_MATRIX_NEAR(a.response.sensitivity, b.response.sensitivity, 1e-12);
  EXPECT_MATRIX_NEAR(a.statistics.covariance, b.statistics.covariance, 1e-12);
}

// A single axis along a line, as a scale that is loaded in steps.
ReadingSet loaded_scale(double bend, std::uint64_t seed) {
  RandomStream random(seed);
  ReadingSet set;
  set.axes = {"z"};
  set.nominal = {2};
  set.response.resize(12, 1);
  set.weights = Eigen::MatrixXd::Ones(12, 1);
  for (Eigen::Index i = 0; i < 12; ++i) {
    const double load = -1.0 + 2.0 * static_cast<double>(i) / 11.0;
    Reading reading{.run = static_cast<int>(i) + 1};
    reading.field_in_sensor = Eigen::Vector3d(0.0, 0.0, load);
    set.readings.push_back(reading);
    set.response(i, 0) = 0.5 + 2.0 * load + bend * load * load + transfer_noise * random.normal();
  }
  return set;
}

TEST(EstimateTransfer, TestsWhetherOneAxisBends) {
  const Eigen::Matrix3Xd up = directions_of({Eigen::Vector3d::UnitZ()});
  const ReadingSet bent = loaded_scale(0.05, 3);
  const Estimate estimate = estimate_transfer(bent, design_by_fields(bent), up);
  ASSERT_TRUE(estimate.curvature.has_value());
  Eigen::MatrixXd X(12, 3);
  const Eigen::VectorXd load = design_by_fields(bent).col(3);
  X << Eigen::VectorXd::Ones(12), load, load.cwiseAbs2();
  const Eigen::Vector3d x = X.colPivHouseholderQr().solve(bent.response.col(0));
  EXPECT_NEAR(estimate.curvature->bends(0), x(2), 1e-10);
  EXPECT_LT(estimate.curvature->p_value, 1e-6);
  // Under the null hypothesis p is uniformly distributed.
  double mean = 0.0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const ReadingSet straight = loaded_scale(0.0, seed);
    mean += estimate_transfer(straight, design_by_fields(straight), up).curvature->p_value / 200.0;
  }
  EXPECT_NEAR(mean, 0.5, 0.08);
}

TEST(EstimateTransfer, KnowsNoBendOfTwoLevels) {
  ReadingSet set = loaded_scale(0.0, 4);
  for (std::size_t i = 0; i < set.readings.size(); ++i) {
    set.readings[i].field_in_sensor = Eigen::Vector3d(0.0, 0.0, i % 2 == 0 ? 1.0 : -1.0);
  }
  const Eigen::Matrix3Xd up = directions_of({Eigen::Vector3d::UnitZ()});
  EXPECT_FALSE(estimate_transfer(set, design_by_fields(set), up).curvature.has_value());
}

TEST(EstimateTransfer, RefusesAnAxisThatDoesNotRespond) {
  ReadingSet set = set_along(directions_of({oblique_line}), 10);
  set.response.col(1).setConstant(0.25);
  EXPECT_THAT(test::complaint_of<RefusedError>([&] {
                static_cast<void>(
                    estimate_transfer(set, design_by_fields(set), directions_of({oblique_line})));
              }),
              HasSubstr("y"));
}

// ---- the record ----

Calibration record_of_transfer(const Estimate& estimate) {
  Calibration record;
  record.sensor.instrument.axes = {"x", "y", "z"};
  record.sensor.response = estimate.response;
  record.fit.statistics = estimate.statistics;
  record.fit.statistics->components.push_back(
      {.name = "blocks", .covariance = Eigen::MatrixXd::Identity(12, 12)});
  add_intervals(record);
  record.fit.uncertainty.emplace();
  record.fit.uncertainty->sources.push_back(
      {.name = "positioner", .covariance = Eigen::MatrixXd::Identity(12, 12)});
  record.fit.uncertainty->sources.push_back({.name = "fit"});
  return record;
}

TEST(ForgetUnseen, TakesOutTheComponentsThatNoFieldHad) {
  const Eigen::Matrix3Xd plane =
      directions_of({Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ()});
  const ReadingSet set = set_along(plane, 15);
  Calibration record = record_of_transfer(estimate_transfer(set, design_by_fields(set), plane));
  const Eigen::MatrixXd before = record.fit.statistics->covariance;
  drop_unobserved_parameters(plane, record);
  const FitStatistics& statistics = *record.fit.statistics;
  EXPECT_THAT(statistics.parameter_names,
              testing::ElementsAre("x.bias", "x.sensitivity.x", "x.sensitivity.z", "y.bias",
                                   "y.sensitivity.x", "y.sensitivity.z", "z.bias",
                                   "z.sensitivity.x", "z.sensitivity.z"));
  const std::vector<Eigen::Index> kept = {0, 1, 3, 4, 5, 7, 8, 9, 11};
  EXPECT_MATRIX_NEAR(statistics.covariance, before(kept, kept), 0.0);
  EXPECT_EQ(statistics.interval_95.size(), 9);
  EXPECT_EQ(statistics.interval_dof.size(), 9);
  EXPECT_EQ(statistics.components[0].covariance.rows(), 9);
  EXPECT_EQ(record.fit.uncertainty->sources[0].covariance.rows(), 9);
  EXPECT_EQ(record.fit.uncertainty->sources[1].covariance.rows(), 0);
  EXPECT_TRUE(statistics.sensitivity_se.col(1).array().isNaN().all());
  EXPECT_TRUE(statistics.sensitivity_se.col(0).allFinite());
  EXPECT_THAT(record.findings.notes,
              test::HasNote(HasSubstr("x.sensitivity.y, y.sensitivity.y, z.sensitivity.y")));
}

TEST(ForgetUnseen, KeepsAllParametersOfAnObliqueLine) {
  const Eigen::Matrix3Xd line = directions_of({oblique_line});
  const ReadingSet set = set_along(line, 15);
  Calibration record = record_of_transfer(estimate_transfer(set, design_by_fields(set), line));
  drop_unobserved_parameters(line, record);
  EXPECT_EQ(record.fit.statistics->parameter_names.size(), 12U);
  EXPECT_EQ(record.fit.statistics->covariance.rows(), 12);
  EXPECT_THAT(record.findings.notes, test::HasNote(HasSubstr("lie in one line")));
}

}  // namespace
}  // namespace axiscal
