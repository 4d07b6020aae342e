// SPDX-License-Identifier: Apache-2.0
// A few labelled readings against a record, compared with plain least squares and with random
// records.
#include "axiscal/calib/labelled_check.hpp"

#include <cmath>
#include <functional>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/record/parameter_names.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

constexpr double sd_of_reading = 1e-4;

// A record of the accelerometer that is practically exact.
Calibration sharp_record(double nu) {
  Calibration record;
  record.sensor = test::accelerometer_truth();
  FitStatistics statistics;
  statistics.parameter_names = parameter_names(record.sensor.instrument.axes);
  statistics.covariance = 1e-20 * Eigen::MatrixXd::Identity(12, 12);
  statistics.degrees_of_freedom = Eigen::Vector3d::Constant(nu);
  statistics.residual_sd = Eigen::Vector3d::Constant(sd_of_reading);
  record.fit.statistics = std::move(statistics);
  return record;
}

Experiment experiment_here() {
  return test::experiment_for(test::accelerometer_truth());
}

Observations some_readings(std::uint64_t seed,
                           std::vector<std::size_t> rows = {0, 2, 4, 7, 8},
                           const Eigen::Vector2d& slope = {0.003, -0.002}) {
  const Observations all =
      test::observe(test::accelerometer_truth(),
                    {.points = 12, .slope = slope, .noise_sd = sd_of_reading, .seed = seed});
  return select_rows(all, rows);
}

double p_labelled(const Calibration& record, const Observations& readings) {
  return check_labelled(record, experiment_here(), readings).p_value;
}

Eigen::Matrix3d rotation_of(const Reading& reading) {
  return Positioner().rotation_table_from_positioner(*reading.point).transpose();
}

// Derivatives of the readings by two rotations of gravity in the table and by the biases.
struct PlainProblem {
  Eigen::MatrixXd by_direction;
  Eigen::MatrixXd by_bias;
  Eigen::VectorXd deviations;
};

PlainProblem plain_problem(const Observations& readings, const Eigen::Vector3d& gravity) {
  const LinearResponse response = test::accelerometer_truth().response;
  const Eigen::Index n = readings.size();
  PlainProblem problem{.by_direction = Eigen::MatrixXd(3 * n, 2),
                       .by_bias = Eigen::Matrix3d::Identity().replicate(n, 1),
                       .deviations = Eigen::VectorXd(3 * n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Matrix3d R = rotation_of(readings.readings[static_cast<std::size_t>(i)]);
    problem.by_direction.middleRows<3>(3 * i) = (response.sensitivity * R).leftCols<2>();
    problem.deviations.segment<3>(3 * i) =
        readings.response.row(i).transpose() - response.bias - response.sensitivity * R * gravity;
  }
  return problem;
}

const Eigen::Vector3d gravity_of_slope(0.003, -0.002, std::sqrt(1.0 - 13e-6));

// If the record is exact, the residuals after the fit of the direction are those of a plain
// regression. The degrees of freedom are divided between the axes.
TEST(CheckOfLabelled, AgreesWithPlainLeastSquares) {
  const double nu = 9.0;
  const Observations readings = some_readings(11);
  const PlainProblem plain = plain_problem(readings, gravity_of_slope);
  const Eigen::MatrixXd& A = plain.by_direction;
  const Eigen::MatrixXd H = A * (A.transpose() * A).inverse() * A.transpose();
  const Eigen::VectorXd left = (plain.deviations - H * plain.deviations) / sd_of_reading;
  FisherSum axes;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const auto rows = Eigen::seqN(k, readings.size(), 3);
    const double q = (1.0 - H.diagonal().array())(rows).sum();
    axes.add(f_upper_p(left(rows).squaredNorm() / q, q, nu));
  }
  EXPECT_NEAR(p_labelled(sharp_record(nu), readings), axes.p_value(), 1e-3);
}

// The columns of the biases are in the regression, so the estimates are those of plain least
// squares. The variance of the record's biases is added.
TEST(CheckOfLabelled, FindsTheChangesOfTheBiases) {
  Calibration record = sharp_record(9.0);
  const double u_bias = 3e-4;
  for (const Eigen::Index k : {0, 4, 8}) {
    record.fit.statistics->covariance(k, k) = u_bias * u_bias;
  }
  const Observations readings = some_readings(12);
  const PlainProblem plain = plain_problem(readings, gravity_of_slope);
  Eigen::MatrixXd X(plain.by_bias.rows(), 5);
  X << plain.by_direction, plain.by_bias;
  const Eigen::MatrixXd C = (X.transpose() * X).inverse();
  const Eigen::VectorXd b = C * (X.transpose() * plain.deviations);
  const DriftCheck check = check_labelled(record, experiment_here(), readings);
  ASSERT_EQ(check.changes.size(), 3U);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const ParameterChange& change = check.changes[static_cast<std::size_t>(k)];
    EXPECT_EQ(change.old_value, record.sensor.response.bias(k));
    EXPECT_NEAR(change.new_value - change.old_value, b(2 + k), 1e-3 * sd_of_reading);
    EXPECT_NEAR(change.u / std::hypot(sd_of_reading * std::sqrt(C(2 + k, 2 + k)), u_bias), 1.0,
                1e-4);
    EXPECT_NEAR(change.z, (change.new_value - change.old_value) / change.u, 1e-12);
  }
  EXPECT_THAT(check.notes, testing::ElementsAre(HasSubstr("the 5 readings are compared with")));
}

TEST(CheckOfLabelled, DoesNotDependOnTheSlopeOfTheTable) {
  const Calibration record = sharp_record(9.0);
  const std::vector<std::size_t> rows = {0, 2, 4, 7, 8};
  const double p = p_labelled(record, some_readings(13, rows, {0.0, 0.0}));
  EXPECT_GT(p, 1e-3);
  EXPECT_NEAR(p_labelled(record, some_readings(13, rows, {0.01, -0.02})), p, 0.03);
  // A field that is too long is not a slope, so the check fails.
  Observations longer = some_readings(13, rows);
  const Eigen::VectorXd bias = record.sensor.response.bias;
  longer.response =
      (1.001 * (longer.response.rowwise() - bias.transpose())).rowwise() + bias.transpose();
  EXPECT_LT(p_labelled(record, longer), 1e-3);
}

TEST(CheckOfLabelled, DoesNotDependOnTheOrderOrTheUnit) {
  const Calibration record = sharp_record(9.0);
  const double p = p_labelled(record, some_readings(14));
  EXPECT_NEAR(p_labelled(record, some_readings(14, {8, 4, 0, 7, 2})), p, 1e-9);
  const double factor = 1e4;
  Calibration scaled = record;
  scaled.sensor.response.bias *= factor;
  scaled.sensor.response.sensitivity *= factor;
  scaled.fit.statistics->residual_sd *= factor;
  scaled.fit.statistics->covariance *= factor * factor;
  Observations readings = some_readings(14);
  readings.response *= factor;
  EXPECT_NEAR(p_labelled(scaled, readings), p, 1e-9);
}

TEST(CheckOfLabelled, PassesOverReadingsThatAreKeptOut) {
  const Calibration record = sharp_record(9.0);
  const Observations good = some_readings(15);
  Observations readings = some_readings(15, {0, 1, 2, 3, 4, 7, 8});
  readings.response.row(1).array() += 1.0;
  readings.response.row(3).array() -= 1.0;
  readings.readings[1].confirm = true;
  Experiment experiment = experiment_here();
  experiment.leave_out = {readings.readings[3].run};
  EXPECT_EQ(check_labelled(record, experiment, readings).p_value, p_labelled(record, good));
}

// Random records with their covariance and scatter, without a change.
TEST(CheckOfLabelled, GivesUniformProbabilitiesWithoutAChange) {
  constexpr int trials = 400;
  constexpr int nu = 8;
  RandomStream random(6);
  int below_tenth = 0;
  int below_half = 0;
  for (std::uint64_t trial = 0; trial < trials; ++trial) {
    Calibration record = sharp_record(nu);
    FitStatistics& statistics = *record.fit.statistics;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double u = 0.5 * sd_of_reading;
      record.sensor.response.bias(k) += u * random.normal();
      record.sensor.response.sensitivity.row(k) += u * random.normals<3>();
      const double ratio = random.normals<nu>().squaredNorm() / nu;
      statistics.residual_sd(k) *= std::sqrt(ratio);
      statistics.covariance.diagonal().segment<4>(4 * k).setConstant(u * u * ratio);
    }
    const double p = p_labelled(record, some_readings(1000 + trial, {0, 3, 4, 9}));
    below_tenth += p < 0.1 ? 1 : 0;
    below_half += p < 0.5 ? 1 : 0;
  }
  EXPECT_NEAR(below_tenth, 40, 28);
  EXPECT_NEAR(below_half, 200, 50);
}

// The readings are of a new block whose biases differ as those of the record's blocks. The record
// has an estimate of their scatter with few degrees of freedom.
TEST(CheckOfLabelled, AllowsForTheScatterOfBlocks) {
  constexpr double sd_of_blocks = 10.0 * sd_of_reading;
  RandomStream random(7);
  for (const int blocks : {2, 4, 8}) {
    int alarms = 0;
    int alarms_by_readings = 0;
    int found = 0;  // changes of 200 times the noise
    for (std::uint64_t trial = 0; trial < 200; ++trial) {
      Calibration record = sharp_record(30.0);
      Eigen::MatrixXd biases(3, blocks);
      for (double& bias : biases.reshaped()) {
        bias = sd_of_blocks * random.normal();
      }
      record.sensor.response.bias += biases.rowwise().mean();
      Observations readings = some_readings(2000 + trial);
      readings.response.rowwise() += sd_of_blocks * random.normals<3>().transpose();
      alarms_by_readings += p_labelled(record, readings) < 0.05 ? 1 : 0;
      record.fit.conditions.blocks = blocks;
      record.fit.conditions.block_mean_square =
          (biases.colwise() - biases.rowwise().mean()).rowwise().squaredNorm() / (blocks - 1.0);
      record.fit.conditions.block_degrees_of_freedom = blocks - 1.0;
      alarms += p_labelled(record, readings) < 0.05 ? 1 : 0;
      readings.response.array() += 20.0 * sd_of_blocks;
      found += p_labelled(record, readings) < 0.01 ? 1 : 0;
    }
    EXPECT_LE(alarms, 18) << blocks;  // 10 expected
    EXPECT_GE(alarms_by_readings, 180);
    EXPECT_GE(found, blocks == 2 ? 60 : 195) << blocks;
  }
}

// The sensitivities of the new block differ as those of the record's blocks.
TEST(CheckOfLabelled, AllowsForSensitivitiesThatDifferBetweenBlocks) {
  Calibration record = sharp_record(30.0);
  record.fit.conditions.blocks = 4;
  record.fit.conditions.sensitivity_mean_square = SensitivityMatrix::Constant(3, 3, 1e-6);
  record.fit.conditions.sensitivity_degrees_of_freedom = 3.0;
  const LinearResponse& response = record.sensor.response;
  Observations readings = some_readings(17);
  RandomStream random(9);
  const Eigen::Vector3d gains = 1e-3 * random.normals<3>();
  for (Eigen::Index i = 0; i < readings.size(); ++i) {
    const Eigen::Vector3d f =
        rotation_of(readings.readings[static_cast<std::size_t>(i)]) * gravity_of_slope;
    readings.response.row(i) += gains.cwiseProduct(response.sensitivity * f).transpose();
  }
  EXPECT_LT(p_labelled(record, readings), 1e-4);  // the record does not say that they differ
  record.fit.statistics->components = {{.name = "block_sensitivities",
                                        .sd = Eigen::Vector3d::Constant(1e-3),
                                        .unit = "",
                                        .covariance = Eigen::MatrixXd::Zero(12, 12),
                                        .degrees_of_freedom = 3.0}};
  EXPECT_GT(p_labelled(record, readings), 0.01);
}

TEST(CheckOfLabelled, AllowsForTheSeatsOfTheCube) {
  Calibration record = sharp_record(30.0);
  Observations readings = some_readings(16);
  const LinearResponse& response = record.sensor.response;
  constexpr double turn_rad = 2e-3;
  RandomStream random(8);
  for (Eigen::Index i = 0; i < readings.size(); ++i) {
    const Eigen::Vector3d f =
        rotation_of(readings.readings[static_cast<std::size_t>(i)]) * gravity_of_slope;
    const Eigen::Vector3d turned = rotation_by(turn_rad * random.normals<3>()) * f;
    readings.response.row(i) += (response.sensitivity * (turned - f)).transpose();
  }
  EXPECT_LT(p_labelled(record, readings), 1e-6);
  record.fit.statistics->components = {{.name = "seats",
                                        .sd = Eigen::VectorXd::Constant(1, turn_rad),
                                        .unit = "rad",
                                        .covariance = Eigen::MatrixXd::Zero(12, 12),
                                        .degrees_of_freedom = 10.0}};
  EXPECT_GT(p_labelled(record, readings), 0.01);
}

TEST(CheckOfLabelled, SeesAChangeOfTheSensitivity) {
  const Calibration record = sharp_record(30.0);
  Observations readings = some_readings(17);
  EXPECT_FALSE(check_labelled(record, experiment_here(), readings).drifted);
  for (Eigen::Index i = 0; i < readings.size(); ++i) {
    readings.response(i, 1) +=
        2e-3 * (rotation_of(readings.readings[static_cast<std::size_t>(i)]) * gravity_of_slope).y();
  }
  EXPECT_TRUE(check_labelled(record, experiment_here(), readings).drifted);
}

TEST(CheckOfLabelled, SaysWhyItIsRefused) {
  const Calibration record = sharp_record(30.0);
  const Observations readings = some_readings(18);
  const auto refusal = [&](const std::function<void(Calibration&, Observations&)>& change) {
    Calibration changed = record;
    Observations given = readings;
    change(changed, given);
    return test::complaint_of<RefusedError>(
        [&] { static_cast<void>(check_labelled(changed, experiment_here(), given)); });
  };
  EXPECT_EQ(refusal([](Calibration&, Observations&) {}), "accepted");
  EXPECT_THAT(
      refusal([](Calibration&, Observations& o) { o = select_rows(o, {0}); }),
      HasSubstr("and the biases, and none is left to check the record. Take 2 readings or more"));
  EXPECT_THAT(refusal([](Calibration&, Observations& o) {
                o = select_rows(o, {1, 1, 1});
              }),
              HasSubstr("; take readings on more faces"));
  EXPECT_THAT(refusal([](Calibration&, Observations& o) { o.has_fence = false; }),
              HasSubstr("the column 'fence'"));
  EXPECT_THAT(refusal([](Calibration& c, Observations&) { c.sensor.field.unit = "m/s^2"; }),
              HasSubstr("the field is in m/s^2 in the record, but in g for the readings"));
  EXPECT_THAT(refusal([](Calibration& c, Observations&) { c.sensor.instrument.one_sided = true; }),
              HasSubstr("has several fields or one-sided axes"));
  EXPECT_THAT(refusal([](Calibration& c, Observations&) { c.sensor.also.resize(1); }),
              HasSubstr("has several fields or one-sided axes"));
  EXPECT_THAT(refusal([](Calibration& c, Observations&) { c.sensor.field.parts.resize(2); }),
              HasSubstr("has several fields or one-sided axes"));
  Calibration bare = record;
  bare.fit.statistics.reset();
  EXPECT_THAT(
      test::complaint_of<DomainError>([&] { static_cast<void>(p_labelled(bare, readings)); }),
      HasSubstr("lacks the covariance"));
}

}  // namespace
}  // namespace axiscal
