// SPDX-License-Identifier: Apache-2.0
// Checks of a record against another record, against biases, and at rest; intrinsic parameters.
#include "axiscal/calib/drift_check.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/intrinsic.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "calib/record/parameter_names.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

constexpr double u_of_parameter = 1e-3;
constexpr double plenty = 1e9;  // degrees of freedom, practically infinite

// A record with independent parameters of equal uncertainty.
Calibration record_of(const LinearResponse& response, double nu, const std::string& kind) {
  Calibration record;
  record.sensor = test::truth_of(response, kind);
  const Eigen::Index m = response.bias.size();
  FitStatistics statistics;
  statistics.parameter_names = parameter_names(record.sensor.instrument.axes);
  statistics.covariance = u_of_parameter * u_of_parameter * Eigen::MatrixXd::Identity(4 * m, 4 * m);
  statistics.degrees_of_freedom = Eigen::VectorXd::Constant(m, nu);
  statistics.residual_sd = Eigen::VectorXd::Constant(m, 4.0 * u_of_parameter);
  record.fit.statistics = std::move(statistics);
  return record;
}

LinearResponse response_times(double scale) {
  return {.bias = Eigen::Vector3d(0.1, -0.2, 0.3),
          .sensitivity = scale * Eigen::Matrix3d::Identity()};
}

Calibration record_of_identity(double nu = plenty) {
  return record_of(response_times(1.0), nu, "generic");
}

Experiment plain_experiment() {
  Experiment experiment = test::experiment_for(test::accelerometer_truth());
  experiment.fit.method = Method::known;
  experiment.fit.seats = SeatSetup::none;
  experiment.fit.drift = DriftSetup::none;
  return experiment;
}

// Rows [1, f] of readings on a level table.
Eigen::MatrixXd rows_on_level_table(const Observations& observations) {
  Eigen::MatrixXd X(observations.size(), 4);
  for (Eigen::Index i = 0; i < observations.size(); ++i) {
    const Eigen::Vector3d f = Positioner()
                                  .rotation_table_from_positioner(
                                      *observations.readings[static_cast<std::size_t>(i)].point)
                                  .transpose()
                                  .col(2);
    X.row(i) << 1.0, f.transpose();
  }
  return X;
}

double squares_left(const Eigen::MatrixXd& X, const Eigen::VectorXd& y) {
  return (y - X * X.householderQr().solve(y)).squaredNorm();
}

// Chow's test (1960): one regression of both runs against two separate ones. If the directions are
// known, this is Hotelling's T^2 with a pooled scatter.
TEST(DriftCheck, AgreesWithChowsTest) {
  const Experiment experiment = plain_experiment();
  const SensorModel truth = test::accelerometer_truth();
  SensorModel moved = truth;
  moved.response.bias(1) += 1e-4;
  moved.response.sensitivity(2, 0) -= 1e-4;
  const Observations before = test::observe(truth, {.points = 24, .noise_sd = 1e-4, .seed = 1});
  const Observations after = test::observe(moved, {.points = 12, .noise_sd = 1e-4, .seed = 5});
  const DriftCheck check =
      check_drift(calibrate(experiment, before), calibrate(experiment, after), 0.2);
  const Eigen::MatrixXd X1 = rows_on_level_table(before);
  const Eigen::MatrixXd X2 = rows_on_level_table(after);
  Eigen::MatrixXd X(36, 4);
  X << X1, X2;
  FisherSum axes;
  for (Eigen::Index k = 0; k < 3; ++k) {
    Eigen::VectorXd y(36);
    y << before.response.col(k), after.response.col(k);
    const double apart =
        squares_left(X1, before.response.col(k)) + squares_left(X2, after.response.col(k));
    axes.add(f_upper_p((squares_left(X, y) - apart) / 4.0 / (apart / 28.0), 4.0, 28.0));
  }
  EXPECT_LT(check.p_value, 0.5);
  EXPECT_NEAR(check.p_value / axes.p_value(), 1.0, 1e-6);
  EXPECT_EQ(check.drifted, check.p_value < 0.2);
  ASSERT_EQ(check.changes.size(), 12U);
  const Eigen::VectorXd change = X2.householderQr().solve(after.response.col(1)) -
                                 X1.householderQr().solve(before.response.col(1));
  EXPECT_EQ(check.changes[4].parameter, "y.bias");
  EXPECT_NEAR(check.changes[4].new_value - check.changes[4].old_value, change(0), 1e-12);
}

// P(F(4, nu) > T^2 / 4) = I_x(nu / 2, 2) with x = nu / (nu + T^2).
TEST(DriftCheck, TakesARecordWithoutCovarianceAsExact) {
  Calibration old = record_of_identity();
  old.fit.statistics.reset();
  const double nu = 6.0;
  Calibration fresh = record_of_identity(nu);
  fresh.sensor.response.bias += u_of_parameter * Eigen::Vector3d(3.0, -2.0, 1.0);
  fresh.sensor.response.sensitivity.row(0) += u_of_parameter * Eigen::RowVector3d(0.0, 2.0, 1.0);
  const DriftCheck check = check_drift(old, fresh);
  FisherSum axes;
  for (const double t2 : {9.0 + 4.0 + 1.0, 4.0, 1.0}) {
    const double x = nu / (nu + t2);
    axes.add(std::pow(x, nu / 2.0) * (1.0 + nu / 2.0 * (1.0 - x)));
  }
  EXPECT_NEAR(check.p_value, axes.p_value(), 1e-9);
  EXPECT_THAT(check.notes, testing::Contains(HasSubstr("are taken as exact")));
  EXPECT_NEAR(check.changes[2].z, 2.0, 1e-9);
}

// If the scatters differ significantly, they are not pooled, and the degrees of freedom are
// Welch's.
TEST(DriftCheck, DoesNotPoolScattersThatDiffer) {
  Calibration old = record_of_identity(8.0);
  Calibration fresh = record_of_identity(4.0);
  old.fit.statistics->covariance *= 100.0;
  old.fit.statistics->residual_sd *= 10.0;
  fresh.sensor.response.bias.setConstant(0.5);
  fresh.sensor.response.sensitivity = 1.01 * Eigen::Matrix3d::Identity();
  const DriftCheck check = check_drift(old, fresh);
  const double nu = 1.0 / (std::pow(100.0 / 101.0, 2) / 8.0 + std::pow(1.0 / 101.0, 2) / 4.0);
  const Eigen::Vector3d d = fresh.sensor.response.bias - old.sensor.response.bias;
  FisherSum axes;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double t2 = (d(k) * d(k) + 1e-4) / (101.0 * u_of_parameter * u_of_parameter);
    axes.add(f_upper_p(t2 / 4.0, 4.0, nu));
  }
  EXPECT_NEAR(check.p_value / axes.p_value(), 1.0, 1e-6);
}

// If parameters and scatters are random and nothing changes, p is uniformly distributed.
TEST(DriftCheck, GivesUniformProbabilitiesWithoutAChange) {
  constexpr int trials = 500;
  constexpr int nu = 6;
  RandomStream random(3);
  const auto drawn = [&] {
    Calibration record = record_of_identity(nu);
    FitStatistics& statistics = *record.fit.statistics;
    for (Eigen::Index k = 0; k < 3; ++k) {
      record.sensor.response.bias(k) += u_of_parameter * random.normal();
      record.sensor.response.sensitivity.row(k) += u_of_parameter * random.normals<3>();
      const double ratio = random.normals<nu>().squaredNorm() / nu;
      statistics.covariance.block<4, 4>(4 * k, 4 * k) *= ratio;
      statistics.residual_sd(k) *= std::sqrt(ratio);
    }
    return record;
  };
  int below_tenth = 0;
  int below_half = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const double p = check_drift(drawn(), drawn()).p_value;
    below_tenth += p < 0.1 ? 1 : 0;
    below_half += p < 0.5 ? 1 : 0;
  }
  EXPECT_NEAR(below_tenth, 50, 27);  // tolerance: four standard deviations
  EXPECT_NEAR(below_half, 250, 45);
}

TEST(DriftCheck, IsTheSameFromEitherSide) {
  const Calibration old = record_of_identity(10.0);
  Calibration fresh = record_of_identity(20.0);
  fresh.sensor.response.bias(0) += 6.0 * u_of_parameter;
  const DriftCheck forth = check_drift(old, fresh);
  const DriftCheck back = check_drift(fresh, old);
  EXPECT_NEAR(forth.p_value, back.p_value, 1e-12);
  EXPECT_LT(forth.p_value, 0.9);
  for (std::size_t i = 0; i < forth.changes.size(); ++i) {
    EXPECT_NEAR(forth.changes[i].z, -back.changes[i].z, 1e-9);
  }
}

TEST(DriftCheck, ConvertsTheUnitOfTheField) {
  Calibration old = record_of_identity(10.0);
  old.sensor.field = {.kind = "geomagnetic", .unit = "uT", .magnitude = 1.0};
  Calibration fresh = old;
  fresh.sensor.response.sensitivity(1, 1) += 4.0 * u_of_parameter;
  const DriftCheck expected = check_drift(old, fresh);
  fresh.sensor.field.unit = "nT";
  fresh.sensor.field.magnitude = 1000.0;
  fresh.sensor.response.sensitivity /= 1000.0;
  Eigen::VectorXd scale = Eigen::VectorXd::Constant(12, 1e-3);
  scale(0) = scale(4) = scale(8) = 1.0;
  Eigen::MatrixXd& C = fresh.fit.statistics->covariance;
  C = scale.asDiagonal() * C * scale.asDiagonal();
  const DriftCheck check = check_drift(old, fresh);
  EXPECT_NEAR(check.p_value, expected.p_value, 1e-9);
  EXPECT_NEAR(check.changes[6].new_value, 1.0 + 4.0 * u_of_parameter, 1e-12);
  EXPECT_NEAR(check.changes[6].u, expected.changes[6].u, 1e-12);
}

TEST(DriftCheck, DoesNotCountTheErrorsThatBothRunsShare) {
  Calibration old = record_of_identity();
  old.provenance.positioner = "cube-1";
  old.sensor.field.magnitude_u = 1e-3;
  const double u_input = 2e-3;
  const Eigen::MatrixXd C = u_input * u_input * Eigen::MatrixXd::Identity(12, 12);
  old.fit.uncertainty = UncertaintyBudget{
      .sources = {{.name = "fit", .type = "A"},
                  {.name = "positioner", .type = "B", .covariance = C},
                  {.name = field_magnitude_source, .type = "B", .covariance = 4.0 * C}}};
  Calibration fresh = old;
  const auto u_of = [&] { return check_drift(old, fresh).changes.front().u; };
  const double by_readings = std::sqrt(2.0) * u_of_parameter;
  EXPECT_NEAR(u_of(), by_readings, 1e-9);
  EXPECT_THAT(
      check_drift(old, fresh).notes,
      testing::ElementsAre(HasSubstr("the same positioner"), HasSubstr("from the same source")));
  fresh.provenance.positioner = "cube-2";
  EXPECT_NEAR(u_of(), std::hypot(by_readings, std::sqrt(2.0) * u_input), 1e-9);
  fresh.sensor.field.model = "wgs84";
  EXPECT_NEAR(u_of(), std::hypot(by_readings, std::sqrt(10.0) * u_input), 1e-9);
  fresh.provenance = old.provenance;
  EXPECT_NEAR(u_of(), std::hypot(by_readings, std::sqrt(8.0) * u_input), 1e-9);
}

TEST(DriftCheck, ComparesAtOneTemperature) {
  Calibration old = record_of_identity();
  old.sensor.temperature =
      TemperatureResponse{.spans = {{.reference = 20.0, .low = 0.0, .high = 50.0}},
                          .bias = Eigen::Vector3d(1e-3, -2e-3, 5e-3),
                          .scale = Eigen::Vector3d(1e-3, 2e-3, -1e-3)};
  // The same instrument with its coefficients at 30 degrees.
  Calibration fresh = old;
  TemperatureResponse& terms = *fresh.sensor.temperature;
  terms.spans.front().reference = 30.0;
  const Eigen::Vector3d scale = Eigen::Vector3d::Ones() + 10.0 * terms.scale;
  fresh.sensor.response.bias += 10.0 * terms.bias;
  fresh.sensor.response.sensitivity = scale.asDiagonal() * fresh.sensor.response.sensitivity;
  terms.scale = terms.scale.cwiseQuotient(scale);
  const DriftCheck check = check_drift(old, fresh);
  for (const ParameterChange& change : check.changes) {
    EXPECT_NEAR(change.new_value, change.old_value, 1e-12) << change.parameter;
  }
  EXPECT_GT(check.p_value, 0.999);
  fresh.sensor.temperature.reset();
  EXPECT_TRUE(check_drift(old, fresh).drifted);
  EXPECT_THAT(check_drift(old, fresh).notes,
              testing::Contains(HasSubstr("only one record has temperature terms")));
}

TEST(DriftCheck, RefusesRecordsThatCannotBeCompared) {
  const Calibration old = record_of_identity();
  const auto complaint_of_change = [&](const std::function<void(Calibration&)>& change) {
    Calibration fresh = old;
    change(fresh);
    return test::complaint_of<DomainError>([&] { static_cast<void>(check_drift(old, fresh)); });
  };
  EXPECT_THAT(complaint_of_change([](Calibration& c) { c.sensor.instrument.axes[2] = "w"; }),
              HasSubstr("different axes: x, y, z and x, y, w"));
  EXPECT_THAT(complaint_of_change([](Calibration& c) { c.sensor.instrument.kind = "optical"; }),
              HasSubstr("different kinds of instrument: generic and optical"));
  EXPECT_THAT(complaint_of_change([](Calibration& c) { c.sensor.field.kind = "light"; }),
              HasSubstr("field gravity with readings in V, and field light"));
  EXPECT_THAT(complaint_of_change([](Calibration& c) { c.sensor.instrument.unit = "mV"; }),
              HasSubstr("with readings in mV"));
  Calibration bare = old;
  bare.fit.statistics.reset();
  EXPECT_THROW(static_cast<void>(check_drift(bare, bare)), DomainError);
  Calibration other = old;
  other.sensor.instrument.serial = "B";
  EXPECT_TRUE(check_drift(old, other).notes.empty());  // the old record has no serial
  Calibration named = old;
  named.sensor.instrument.serial = "A";
  EXPECT_THAT(check_drift(named, other).notes,
              testing::ElementsAre(HasSubstr("different serial numbers: A and B")));
}

TEST(WorstAngle, IsThatOfTheShiftOrTheTurn) {
  const Calibration used = record_of_identity();
  EXPECT_LT(worst_angle(used, used).error_deg, 1e-9);
  // A change of the field by delta F rotates some direction by asin(delta).
  const double delta = 0.02;
  Calibration now = used;
  now.sensor.response.bias += delta * Eigen::Vector3d(0.6, 0.0, -0.8);
  const WorstAngle worst = worst_angle(used, now);
  EXPECT_NEAR(worst.error_deg, std::asin(delta) * deg_per_rad, 2e-3 * worst.error_deg + 1e-3);
  EXPECT_NEAR(worst.field.dot(Eigen::Vector3d(0.6, 0.0, -0.8)), -delta, 0.1);
  // A rotation is found with its angle. A common factor does not rotate any direction.
  const double turn = 0.01;
  now = used;
  now.sensor.response.sensitivity = 1.7 * rotation_by(turn * Eigen::Vector3d(0.0, 0.6, 0.8));
  EXPECT_NEAR(worst_angle(used, now).error_deg, turn * deg_per_rad, 1e-3 * turn * deg_per_rad);
}

TEST(WorstAngle, OfAnAccelerometerIsThatOfThePitch) {
  const Calibration used = record_of(response_times(2.0), plenty, "accelerometer");
  Calibration now = used;
  now.sensor.response.sensitivity = 2.0 * rotation_by(0.02 * Eigen::Vector3d::UnitX());
  EXPECT_LT(worst_angle(used, now).error_deg, 1e-9);  // changes the roll only
  now.sensor.response.sensitivity = 2.0 * rotation_by(0.02 * Eigen::Vector3d::UnitY());
  EXPECT_NEAR(worst_angle(used, now).error_deg, 0.02 * deg_per_rad, 1e-2 * 0.02 * deg_per_rad);
  const LinearResponse of_two{.bias = Eigen::Vector2d::Zero(),
                              .sensitivity = Eigen::MatrixXd::Identity(2, 3)};
  const Calibration two = record_of(of_two, plenty, "accelerometer");
  EXPECT_TRUE(std::isnan(worst_angle(two, two).error_deg));
  EXPECT_TRUE(std::isnan(check_drift(two, two).pitch_error_u_deg));
}

// Only the biases are uncertain, equally in all directions. The direction then has the uncertainty
// u / S / F in each component.
TEST(WorstAngle, HasTheUncertaintyOfTheBiasesAcrossIt) {
  Calibration record = record_of(response_times(2.0), plenty, "generic");
  for (const Eigen::Index k : {0, 4, 8}) {
    record.fit.statistics->covariance.diagonal().segment<3>(k + 1).setZero();
  }
  const DriftCheck check = check_drift(record, record);
  const double u_deg = std::sqrt(2.0) * u_of_parameter / 2.0 * deg_per_rad;
  EXPECT_NEAR(check.pitch_error_u_deg, u_deg, 1e-9);
  // Scheffe: the 95 % quantile of chi-squared with six degrees of freedom is 12.5916.
  EXPECT_NEAR(check.pitch_error_expanded_deg, std::sqrt(12.5916) * u_deg, 1e-5 * u_deg);
}

TEST(WorstAngle, IsWithinItsIntervalWithoutAChange) {
  RandomStream random(5);
  const Calibration record = record_of_identity();
  int within = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Calibration old = record;
    Calibration fresh = record;
    for (Calibration* const one : {&old, &fresh}) {
      one->sensor.response.bias += u_of_parameter * random.normals<3>();
      for (double& value : one->sensor.response.sensitivity.reshaped()) {
        value += u_of_parameter * random.normal();
      }
    }
    const DriftCheck check = check_drift(old, fresh);
    within += check.pitch_error_deg <= check.pitch_error_expanded_deg ? 1 : 0;
  }
  EXPECT_GE(within, 180);
}

// ---- intrinsic parameters ----

TEST(IntrinsicParameters, DoNotDependOnTheMounting) {
  Calibration record = record_of(test::accelerometer_truth().response, 20.0, "generic");
  const Eigen::Matrix3d R = rotation_by(Eigen::Vector3d(0.5, -1.2, 0.8));
  Calibration turned = record;
  turned.sensor.response.sensitivity *= R;
  // The covariance of independent, equal components does not change by a rotation.
  const IntrinsicParameters a = intrinsic_parameters(record);
  const IntrinsicParameters b = intrinsic_parameters(turned);
  EXPECT_EQ(a.names, b.names);
  EXPECT_MATRIX_NEAR(a.values, b.values, 1e-14);
  EXPECT_MATRIX_NEAR(a.covariance, b.covariance, 1e-15);
  const DriftCheck check = check_drift(record, turned);
  EXPECT_TRUE(check.drifted);
  for (const ParameterChange& change : check.intrinsic) {
    EXPECT_LT(std::abs(change.e_n), 1e-9) << change.parameter;
  }
}

TEST(IntrinsicParameters, HaveTheAngleAndLengthOfTheRows) {
  Calibration record = record_of_identity();
  const double angle = 1.2;
  record.sensor.response.sensitivity.row(1) << 3.0 * std::cos(angle), 3.0 * std::sin(angle), 0.0;
  const IntrinsicParameters found = intrinsic_parameters(record);
  ASSERT_EQ(found.names[3], "y.sensitivity");
  ASSERT_EQ(found.names[6], "angle.x.y");
  EXPECT_NEAR(found.values(3), 3.0, 1e-14);
  EXPECT_NEAR(found.values(6), angle, 1e-14);
  EXPECT_NEAR(found.uncertainty[3].u, u_of_parameter, 1e-15);
  // Each row rotates in the plane of both rows by u / |S|.
  EXPECT_NEAR(found.uncertainty[6].u, std::hypot(u_of_parameter, u_of_parameter / 3.0), 1e-12);
  record.fit.statistics.reset();
  EXPECT_TRUE(intrinsic_parameters(record).uncertainty.empty());
  EXPECT_EQ(e_n_score(1.0, 0.3, 2.0, 0.4), -e_n_score(2.0, 0.4, 1.0, 0.3));
}

// ---- biases ----

// A record of two biases, each with one temperature term.
Calibration record_of_biases(double nu) {
  Calibration record;
  record.sensor = test::truth_of(
      {.bias = Eigen::Vector2d(0.1, -0.2), .sensitivity = Eigen::MatrixXd::Identity(2, 3)},
      "generic");
  FitStatistics statistics;
  statistics.parameter_names = {"x.bias", "x.bias.d", "y.bias", "y.bias.d"};
  statistics.covariance = Eigen::Vector4d(4e-6, 1e-8, 4e-6, 1e-8).asDiagonal();
  statistics.covariance(0, 1) = statistics.covariance(1, 0) = -1e-7;
  statistics.degrees_of_freedom = Eigen::Vector2d::Constant(nu);
  statistics.residual_sd = Eigen::Vector2d::Constant(5e-3);
  record.fit.statistics = std::move(statistics);
  record.sensor.temperature = TemperatureResponse{.spans = {{.reference = 20.0}},
                                                  .bias = Eigen::Vector2d(2e-3, 0.0),
                                                  .scale = Eigen::Vector2d::Zero()};
  return record;
}

TEST(CheckBiases, PropagatesTheTermsOfTheTemperature) {
  const Calibration old = record_of_biases(10.0);
  Calibration fresh = record_of_biases(16.0);
  fresh.sensor.temperature.reset();
  fresh.fit.statistics->parameter_names = {"x.bias", "y.bias"};
  fresh.fit.statistics->covariance = 9e-6 * Eigen::Matrix2d::Identity();
  fresh.sensor.response.bias += Eigen::Vector2d(8e-3, -2e-3);
  const double d = 5.0;
  const DriftCheck check = check_biases(old, fresh, SensorTemperature(20.0 + d), 0.3);
  const Eigen::Vector2d before(4e-6 - 2.0 * d * 1e-7 + d * d * 1e-8, 4e-6 + d * d * 1e-8);
  FisherSum axes;
  for (Eigen::Index k = 0; k < 2; ++k) {
    const double variance = before(k) + 9e-6;
    const double nu = variance * variance / (before(k) * before(k) / 10.0 + 81e-12 / 16.0);
    const double z = (k == 0 ? 8e-3 : -2e-3) / std::sqrt(variance);
    const ParameterChange& change = check.changes[static_cast<std::size_t>(k)];
    EXPECT_NEAR(change.u, std::sqrt(variance), 1e-12);
    EXPECT_NEAR(change.z, z, 1e-9);
    axes.add(student_t_two_sided_p(z, nu));
  }
  EXPECT_NEAR(check.changes[0].old_value, 0.1 + d * 2e-3, 1e-15);
  EXPECT_NEAR(check.p_value, axes.p_value(), 1e-9);
  EXPECT_EQ(check.drifted, check.p_value < 0.3);
  EXPECT_THAT(check.notes, testing::ElementsAre(HasSubstr("at temperature 25")));
  // Without a temperature the reference temperature is used.
  EXPECT_EQ(check_biases(old, fresh, {}).changes[0].old_value, 0.1);
}

TEST(CheckBiases, FindsNoChangeInRoundingAndNeedsACovariance) {
  Calibration old = record_of_biases(10.0);
  old.fit.statistics->covariance.setZero();  // readings without noise
  Calibration fresh = old;
  fresh.sensor.response.bias(0) *= 1.0 + 4e-16;
  EXPECT_EQ(check_biases(old, fresh, {}).p_value, 1.0);
  fresh.sensor.instrument.axes = {"x", "w"};
  EXPECT_THAT(
      test::complaint_of<DomainError>([&] { static_cast<void>(check_biases(old, fresh, {})); }),
      HasSubstr("the axes of the two calibrations are not the same"));
  fresh = old;
  fresh.fit.statistics.reset();
  EXPECT_THAT(
      test::complaint_of<DomainError>([&] { static_cast<void>(check_biases(old, fresh, {})); }),
      HasSubstr("lacks the covariance"));
}

// ---- at rest ----

// Readings of a record in these directions. The length of each field is multiplied by a factor.
Observations rest_at(const Calibration& record,
                     const std::vector<Eigen::Vector3d>& directions,
                     const std::vector<double>& lengths) {
  Observations rest;
  rest.response.resize(std::ssize(directions), record.sensor.response.bias.size());
  for (std::size_t i = 0; i < directions.size(); ++i) {
    rest.readings.push_back({.run = static_cast<int>(i) + 10});
    rest.response.row(static_cast<Eigen::Index>(i)) =
        record.sensor.response.at(lengths[i] * directions[i].normalized());
  }
  return rest;
}

TEST(ReadingsAtReference, AreThoseOfTheReferenceTemperature) {
  Calibration record = record_of_identity();
  const Observations expected =
      rest_at(record, {Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(-1, 0, 1)}, {1.0, 1.0});
  EXPECT_EQ(at_reference_temperature(expected, record).response, expected.response);
  record.sensor.temperature = TemperatureResponse{.spans = {{.reference = 20.0}},
                                                  .bias = Eigen::Vector3d(1e-3, 0.0, 2e-3),
                                                  .scale = Eigen::Vector3d(0.0, 1e-3, -2e-3)};
  Observations warm = expected;
  const Eigen::Vector3d f = Eigen::Vector3d(1, 2, 3).normalized();
  for (Eigen::Index k = 0; k < 3; ++k) {
    warm.response(0, k) = record.sensor.response.bias(k) +
                          7.0 * record.sensor.temperature->bias(k) +
                          (1.0 + 7.0 * record.sensor.temperature->scale(k)) * f(k);
  }
  warm.readings[0].temperature = 27.0;
  EXPECT_MATRIX_NEAR(at_reference_temperature(warm, record).response, expected.response, 1e-14);
}

// The record is practically exact, so |f| - F has the scatter s / S.
TEST(CheckInSitu, TestsTheMeanOfAPoseAndTheWorstReading) {
  const double nu = 12.0;
  Calibration record = record_of(response_times(2.0), nu, "generic");
  record.fit.statistics->covariance *= 1e-12;
  const double sd = 4.0 * u_of_parameter / 2.0;
  const std::vector<Eigen::Vector3d> pose(4, Eigen::Vector3d(1.0, 2.0, -2.0));
  for (const std::vector<double>& z :
       {std::vector<double>{1.0, 2.0, 0.5, 1.2}, std::vector<double>{4.5, -1.5, -1.5, -1.5}}) {
    std::vector<double> lengths;
    double sum = 0.0;
    double squares = 0.0;
    double furthest = 0.0;
    for (const double one : z) {
      lengths.push_back(1.0 + one * sd);
      sum += one;
      squares += one * one;
      furthest = std::max(furthest, std::abs(one));
    }
    const InSituCheck check = check_in_situ(record, rest_at(record, pose, lengths), 0.01);
    EXPECT_NEAR(check.rss, std::sqrt(squares) * sd, 1e-9);
    EXPECT_NEAR(check.expected_rss, std::sqrt(4.0) * sd, 1e-3 * sd);
    EXPECT_NEAR(check.readings[1].residual, z[1] * sd, 1e-12);
    EXPECT_NEAR(check.readings[1].limit / (sd * student_t_factor(1.0 - 0.2 * 0.01 / 4.0, nu)), 1.0,
                1e-3);
    const double p = std::min({1.0, student_t_two_sided_p(sum / 2.0, nu) / 0.8,
                               4.0 * student_t_two_sided_p(furthest, nu) / 0.2});
    EXPECT_NEAR(check.p_value / p, 1.0, 0.01);
    EXPECT_EQ(check.drifted, check.p_value < 0.01);
  }
}

// Many readings in one pose cannot test more precisely than the calibration.
TEST(CheckInSitu, DoesNotKnowMoreThanTheCalibration) {
  Calibration record = record_of_identity();
  record.fit.statistics->residual_sd.setConstant(u_of_parameter);
  const Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  const double u = std::sqrt(2.0) * u_of_parameter;  // by bias and sensitivity
  const double z = 1.7;
  double before = 1.0;
  for (const std::size_t n : {std::size_t{1}, std::size_t{4}, std::size_t{400}}) {
    const double p =
        check_in_situ(record, rest_at(record, std::vector<Eigen::Vector3d>(n, direction),
                                      std::vector<double>(n, 1.0 + z * u)))
            .p_value;
    EXPECT_LE(p, before);
    before = p;
  }
  EXPECT_NEAR(before, student_t_two_sided_p(z, 1e6) / 0.8, 2e-3);
}

TEST(CheckInSitu, SeesAChangeOfTheBiasInSeveralPoses) {
  Calibration record = record_of_identity();
  std::vector<Eigen::Vector3d> poses;
  for (const double sign : {1.0, -1.0}) {
    for (int j = 0; j < 3; ++j) {
      poses.insert(poses.end(), 9, sign * Eigen::Vector3d::Unit(j));
    }
  }
  const Observations good = rest_at(record, poses, std::vector<double>(poses.size(), 1.0));
  EXPECT_EQ(check_in_situ(record, good).p_value, 1.0);
  Observations moved = good;
  moved.response.col(0).array() += 8.0 * u_of_parameter;
  const InSituCheck check = check_in_situ(record, moved);
  EXPECT_TRUE(check.drifted);
  // No single reading shows the change, because its noise is four times u.
  EXPECT_TRUE(check.readings.front().within);
  EXPECT_EQ(check.readings.front().run, 10);
  // If blocks differ as much, the change is not a drift.
  record.fit.conditions.blocks = 4;
  record.fit.conditions.block_mean_square = Eigen::Vector3d::Constant(64e-6);
  record.fit.conditions.block_degrees_of_freedom = 3.0;
  EXPECT_FALSE(check_in_situ(record, moved).drifted);
  moved.response.col(0).array() += 0.2;
  EXPECT_TRUE(check_in_situ(record, moved).drifted);
}

TEST(CheckInSitu, NeedsThreeAxes) {
  const LinearResponse of_two{.bias = Eigen::Vector2d::Zero(),
                              .sensitivity = Eigen::MatrixXd::Identity(2, 3)};
  const Calibration two = record_of(of_two, plenty, "generic");
  const Observations rest = rest_at(two, {Eigen::Vector3d::UnitX()}, {1.0});
  EXPECT_THAT(test::complaint_of<DomainError>([&] { static_cast<void>(check_in_situ(two, rest)); }),
              HasSubstr("requires at least three axes"));
}

}  // namespace
}  // namespace axiscal
