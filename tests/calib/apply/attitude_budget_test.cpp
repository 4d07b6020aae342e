// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <Eigen/LU>
#include <gmock/gmock.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/instruments/inclination.hpp"
#include "calib/record/parameter_names.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double noise_of_run = 1e-4;
constexpr double t_of_5_degrees = 2.570582;  // Student's t for 95 % and 5 degrees of freedom

// A record with stated uncertainties and without the scatter between its blocks.
Calibration record_with_budget(int replicates = 4) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.fit.method = Method::joint;
  experiment.fit.seats = SeatSetup::none;
  experiment.field.magnitude_u = 5e-5;
  experiment.positioner = test::uncertain_cube(1e-4);
  Calibration record = calibrate(
      experiment,
      test::observe(truth, {.replicates = replicates, .noise_sd = noise_of_run, .seed = 21}));
  record.fit.conditions = {};
  return record;
}

const Calibration& the_budgeted_record() {
  static const Calibration one = record_with_budget();
  return one;
}

std::map<std::string, AttitudeQuantity> by_name(const AttitudeBudget& budget) {
  std::map<std::string, AttitudeQuantity> all;
  for (const AttitudeQuantity& quantity : budget.quantities) {
    all[quantity.name] = quantity;
  }
  return all;
}

double part_of(const AttitudeBudget& budget,
               const std::string& quantity,
               const std::string& source) {
  const auto at = std::find(budget.sources.begin(), budget.sources.end(), source);
  return by_name(budget).at(quantity).uncertainty.by_source.at(
      static_cast<std::size_t>(at - budget.sources.begin()));
}

Eigen::Vector3d field_at_deg(const SensorModel& sensor, double pitch_deg, double roll_deg) {
  return field_of_attitude(sensor, pitch_deg * rad_per_deg, roll_deg * rad_per_deg);
}

// ---- attitudes ----

// Forward-left-up: nose up shows gravity's reaction along x, right side down along y.
TEST(FieldOfAnAttitude, IsTheVerticalInTheSensorsFrame) {
  SensorModel sensor = test::accelerometer_truth();
  sensor.field.magnitude = 9.81;
  for (const double pitch : {-1.2, -0.3, 0.0, 0.8}) {
    for (const double roll : {-2.5, -0.4, 0.0, 1.7}) {
      const Eigen::Vector3d expected(std::sin(pitch), std::sin(roll) * std::cos(pitch),
                                     std::cos(roll) * std::cos(pitch));
      sensor.instrument.convention = AxisConvention::forward_left_up;
      EXPECT_MATRIX_NEAR(field_of_attitude(sensor, pitch, roll), 9.81 * expected, 1e-12);
      sensor.instrument.convention = AxisConvention::forward_right_down;
      EXPECT_MATRIX_NEAR(field_of_attitude(sensor, pitch, roll),
                         9.81 * expected.cwiseProduct(Eigen::Vector3d(1.0, -1.0, -1.0)), 1e-12);
    }
  }
}

TEST(BudgetOfAnAttitude, HasTheAnglesAsItsValues) {
  const Calibration& record = the_budgeted_record();
  for (const double pitch : {-60.0, 0.0, 33.0}) {
    for (const double roll : {-120.0, 12.0, 170.0}) {
      const Eigen::Vector3d f = field_at_deg(record.sensor, pitch, roll);
      const std::map<std::string, AttitudeQuantity> all =
          by_name(attitude_budget(record, {}, {}, f));
      EXPECT_NEAR(all.at("pitch_deg").value, pitch, 1e-9);
      EXPECT_NEAR(all.at("roll_deg").value, roll, 1e-9);
      EXPECT_FALSE(all.contains("yaw_deg"));
      EXPECT_NEAR(all.at("field_x").value, f.x(), 1e-12);
      EXPECT_NEAR(all.at("field_z").value, f.z(), 1e-12);
      EXPECT_NEAR(all.at("residual").value, 0.0, 1e-12);
    }
  }
}

// Near the vertical the budget has the yaw and not the roll.
TEST(BudgetOfAnAttitude, HasAYawIfTheNoseIsUp) {
  const Calibration& record = the_budgeted_record();
  const std::map<std::string, AttitudeQuantity> all =
      by_name(attitude_budget(record, {}, {}, field_at_deg(record.sensor, 88.0, 30.0)));
  EXPECT_NEAR(all.at("pitch_deg").value, 88.0, 1e-8);
  EXPECT_TRUE(all.contains("yaw_deg"));
  EXPECT_FALSE(all.contains("roll_deg"));
}

// ---- parts ----

TEST(PartsOfAnAttitudeBudget, AreTheRecordsSourcesAndTheReading) {
  const Calibration& record = the_budgeted_record();
  const AttitudeBudget budget =
      attitude_budget(record, {}, {}, field_at_deg(record.sensor, 20.0, -30.0));
  std::vector<std::string> expected;
  for (const UncertaintySource& source : record.fit.uncertainty->sources) {
    expected.push_back(source.name);
  }
  expected.emplace_back("reading");
  EXPECT_EQ(budget.sources, expected);
  EXPECT_THAT(expected, testing::IsSupersetOf({"fit", "positioner", "field magnitude"}));
  for (const AttitudeQuantity& quantity : budget.quantities) {
    ASSERT_EQ(quantity.uncertainty.by_source.size(), expected.size()) << quantity.name;
    double squares = 0.0;
    for (const double part : quantity.uncertainty.by_source) {
      EXPECT_GE(part, 0.0);
      squares += part * part;
    }
    EXPECT_NEAR(quantity.uncertainty.u / std::sqrt(squares), 1.0, 1e-9) << quantity.name;
    EXPECT_NEAR(quantity.uncertainty.expanded,
                quantity.uncertainty.coverage_factor * quantity.uncertainty.u,
                1e-12 + 1e-9 * quantity.uncertainty.u);
  }
}

TEST(PartsOfAnAttitudeBudget, AreTheFitAloneWithoutABudget) {
  Calibration record = the_budgeted_record();
  record.fit.uncertainty.reset();
  const AttitudeBudget budget =
      attitude_budget(record, {}, {}, field_at_deg(record.sensor, 20.0, -30.0));
  EXPECT_THAT(budget.sources, ElementsAre("fit", "reading"));
}

// d pitch / d f_x = 1 / (F cos(pitch)).
TEST(PartsOfAnAttitudeBudget, HaveTheReadingsScatterByTheInverse) {
  const Calibration& record = the_budgeted_record();
  const Eigen::Matrix3d inverse = Eigen::Matrix3d(record.sensor.response.sensitivity).inverse();
  const Eigen::Vector3d variances = record.fit.statistics->residual_sd.cwiseAbs2();
  for (const double pitch : {-70.0, -20.0, 0.0, 45.0}) {
    const AttitudeBudget budget =
        attitude_budget(record, {}, {}, field_at_deg(record.sensor, pitch, 15.0));
    const double along_x = std::sqrt(inverse.row(0).cwiseAbs2().dot(variances));
    EXPECT_NEAR(part_of(budget, "field_x", "reading"), along_x, 1e-6 * along_x);
    const double expected = along_x / std::cos(pitch * rad_per_deg) * deg_per_rad;
    EXPECT_NEAR(part_of(budget, "pitch_deg", "reading") / expected, 1.0, 1e-4);
  }
}

// The part of each source is computed from its covariance by the derivatives of the closed
// formulas.
TEST(PartsOfAnAttitudeBudget, HaveEachSourceByItsCovariance) {
  const Calibration& record = the_budgeted_record();
  const Eigen::Matrix3d inverse = Eigen::Matrix3d(record.sensor.response.sensitivity).inverse();
  const Eigen::Vector3d f = field_at_deg(record.sensor, 25.0, -50.0);
  const AttitudeBudget budget = attitude_budget(record, {}, {}, f);
  Eigen::Matrix<double, 3, 12> by_parameters = Eigen::Matrix<double, 3, 12>::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    by_parameters.block<1, 4>(k, 4 * k) << 1.0, f.x(), f.y(), f.z();
  }
  const Eigen::Matrix<double, 3, 12> of_field = -inverse * by_parameters;
  const Eigen::RowVector3d of_pitch =
      deg_per_rad / std::sqrt(1.0 - f.x() * f.x()) * Eigen::RowVector3d::UnitX();
  const Eigen::RowVector3d of_roll =
      deg_per_rad / (f.y() * f.y() + f.z() * f.z()) * Eigen::RowVector3d(0.0, f.z(), -f.y());
  for (const UncertaintySource& source : record.fit.uncertainty->sources) {
    const Eigen::MatrixXd& C =
        source.type == "A" ? record.fit.statistics->covariance : source.covariance;
    const Eigen::Matrix3d of_components = of_field * C * of_field.transpose();
    for (Eigen::Index j = 0; j < 3; ++j) {
      EXPECT_NEAR(part_of(budget, "field_" + std::string(1, "xyz"[j]), source.name),
                  std::sqrt(of_components(j, j)), 1e-9)
          << source.name;
    }
    if (source.name != field_magnitude_source) {
      EXPECT_NEAR(part_of(budget, "pitch_deg", source.name),
                  std::sqrt(of_pitch * of_components * of_pitch.transpose()), 2e-7)
          << source.name;
      EXPECT_NEAR(part_of(budget, "roll_deg", source.name),
                  std::sqrt(of_roll * of_components * of_roll.transpose()), 2e-7)
          << source.name;
    }
  }
}

TEST(PartsOfAnAttitudeBudget, HaveTheMagnitudeInComponentsOnly) {
  const Calibration& record = the_budgeted_record();
  const Eigen::Vector3d f = field_at_deg(record.sensor, 25.0, -50.0);
  const AttitudeBudget budget = attitude_budget(record, {}, {}, f);
  for (Eigen::Index j = 0; j < 3; ++j) {
    EXPECT_NEAR(part_of(budget, "field_" + std::string(1, "xyz"[j]), field_magnitude_source),
                5e-5 * std::abs(f(j)), 1e-9);
  }
  for (const char* angle : {"pitch_deg", "roll_deg", "residual"}) {
    EXPECT_EQ(part_of(budget, angle, field_magnitude_source), 0.0) << angle;
  }
}

// A reading that is taken later belongs to another block, so the scatter between blocks is added.
TEST(PartsOfAnAttitudeBudget, HaveALaterBlockIfBlocksScatter) {
  Calibration record = the_budgeted_record();
  const Eigen::Vector3d f = field_at_deg(record.sensor, 25.0, -50.0);
  const double before = by_name(attitude_budget(record, {}, {}, f)).at("field_y").uncertainty.u;
  CalibrationConditions& conditions = record.fit.conditions;
  conditions.blocks = 4;
  conditions.block_mean_square = Eigen::Vector3d(4e-6, 9e-6, 1e-6);
  conditions.block_degrees_of_freedom = 3.0;
  const AttitudeBudget budget = attitude_budget(record, {}, {}, f);
  EXPECT_EQ(budget.sources.back(), "later block");
  const Eigen::Matrix3d inverse = Eigen::Matrix3d(record.sensor.response.sensitivity).inverse();
  Eigen::Vector3d between = conditions.block_mean_square;
  for (Eigen::Index k = 0; k < 3; ++k) {
    between(k) -= 4.0 * record.fit.statistics->covariance_of_readings()(4 * k, 4 * k);
  }
  const double expected = std::sqrt(inverse.row(1).cwiseAbs2().dot(between));
  EXPECT_NEAR(part_of(budget, "field_y", "later block"), expected, 1e-6 * expected);
  const CombinedUncertainty with = by_name(budget).at("field_y").uncertainty;
  EXPECT_NEAR(with.u, std::hypot(before, expected), 1e-9);
  EXPECT_GT(with.coverage_factor, 2.5) << "three degrees of freedom";
}

// ---- in agreement with single readings ----

TEST(BudgetOfAnAttitude, AgreesWithThePropagationOfItsReading) {
  const Calibration& record = the_budgeted_record();
  const Reducer reducer(record);
  const ReadingPropagation propagation(record, reducer);
  for (const double pitch : {-40.0, 5.0, 70.0}) {
    for (const double roll : {-150.0, 0.0, 60.0}) {
      const Eigen::Vector3d f = field_at_deg(record.sensor, pitch, roll);
      const Eigen::VectorXd v = record.sensor.response.at(f);
      const ReducedUncertainty u = propagation.at({v.data(), 3});
      const std::map<std::string, AttitudeQuantity> all =
          by_name(attitude_budget(record, {}, {}, f));
      for (Eigen::Index j = 0; j < 3; ++j) {
        const CombinedUncertainty& own = all.at("field_" + std::string(1, "xyz"[j])).uncertainty;
        EXPECT_NEAR(own.u / u.field_in_sensor(j), 1.0, 1e-3);
        EXPECT_NEAR(own.expanded / u.expanded.field_in_sensor(j), 1.0, 0.02);
      }
      EXPECT_NEAR(all.at("pitch_deg").uncertainty.u / u.derived[0], 1.0, 1e-3);
      EXPECT_NEAR(all.at("roll_deg").uncertainty.u / u.derived[1], 1.0, 1e-3);
      EXPECT_NEAR(all.at("pitch_deg").uncertainty.expanded / u.expanded.derived[0], 1.0, 0.02);
    }
  }
}

TEST(BudgetOfAnAttitude, ScalesComponentsWithTheUnit) {
  const Calibration& record = the_budgeted_record();
  const Eigen::Vector3d f = field_at_deg(record.sensor, 25.0, -50.0);
  const auto in_g = by_name(attitude_budget(record, {}, {}, f));
  const auto in_si = by_name(attitude_budget(record, {.magnitude = 9.81, .factor = 9.81}, {}, f));
  for (const char* component : {"field_x", "field_y", "field_z"}) {
    EXPECT_NEAR(in_si.at(component).value, 9.81 * in_g.at(component).value, 1e-10);
    EXPECT_NEAR(in_si.at(component).uncertainty.u / in_g.at(component).uncertainty.u, 9.81, 1e-6);
  }
  for (const char* angle : {"pitch_deg", "roll_deg"}) {
    EXPECT_NEAR(in_si.at(angle).value, in_g.at(angle).value, 1e-9);
    EXPECT_NEAR(in_si.at(angle).uncertainty.u / in_g.at(angle).uncertainty.u, 1.0, 1e-6);
  }
}

// By atan2 the uncertainty of the pitch is the same at every pitch. By asin it grows near the
// vertical.
TEST(BudgetOfAnAttitude, IsAsGoodEverywhereByTheArctangent) {
  Calibration record = the_budgeted_record();
  record.fit.uncertainty.reset();
  record.sensor.response.sensitivity = 2.5 * Eigen::Matrix3d::Identity();
  record.fit.statistics->covariance = 1e-12 * Eigen::MatrixXd::Identity(12, 12);
  record.fit.statistics->residual_sd = Eigen::Vector3d::Constant(1e-4);
  const auto u_of = [&](PitchFormula formula, double pitch) {
    ReductionOptions options;
    options.inclination.pitch_formula = formula;
    return by_name(attitude_budget(record, options, {}, field_at_deg(record.sensor, pitch, 40.0)))
        .at("pitch_deg")
        .uncertainty.u;
  };
  const double level = u_of(PitchFormula::arctangent, 0.0);
  for (const double pitch : {30.0, 60.0, 80.0}) {
    EXPECT_NEAR(u_of(PitchFormula::arctangent, pitch) / level, 1.0, 0.01) << pitch;
    EXPECT_NEAR(u_of(PitchFormula::arcsine, pitch) * std::cos(pitch * rad_per_deg) / level, 1.0,
                0.01)
        << pitch;
  }
}

// A change of the signs of y and z gives the other axis convention. Angles and their uncertainties
// stay the same.
TEST(BudgetOfAnAttitude, IsTheSameInEitherConvention) {
  const Calibration& record = the_budgeted_record();
  Calibration down = record;
  const Eigen::Vector3d over(1.0, -1.0, -1.0);
  down.sensor.rotation_sensor_from_assembly = Eigen::Matrix3d(over.asDiagonal());
  down = in_assembly_frame(down);
  down.sensor.instrument.convention = AxisConvention::forward_right_down;
  const Eigen::Vector3d f = field_at_deg(record.sensor, 25.0, -50.0);
  const Eigen::Vector3d turned = field_at_deg(down.sensor, 25.0, -50.0);
  EXPECT_MATRIX_NEAR(turned, f.cwiseProduct(over), 1e-14);
  const auto one = by_name(attitude_budget(record, {}, {}, f));
  const auto other = by_name(attitude_budget(down, {}, {}, turned));
  for (const char* angle : {"pitch_deg", "roll_deg"}) {
    EXPECT_NEAR(one.at(angle).value, other.at(angle).value, 1e-10);
    EXPECT_NEAR(one.at(angle).uncertainty.u / other.at(angle).uncertainty.u, 1.0, 1e-6);
    EXPECT_NEAR(one.at(angle).uncertainty.expanded / other.at(angle).uncertainty.expanded, 1.0,
                1e-6);
  }
}

TEST(BudgetOfAnAttitude, GrowsWithTheNoiseThatIsStated) {
  const Calibration& record = the_budgeted_record();
  const Eigen::Vector3d f = field_at_deg(record.sensor, 10.0, 10.0);
  const auto budget_with = [&](double sd) {
    return attitude_budget(record, {}, {.sd = Eigen::Vector3d::Constant(sd)}, f);
  };
  const AttitudeBudget quiet = budget_with(1e-4);
  const AttitudeBudget loud = budget_with(1e-2);
  EXPECT_NEAR(part_of(loud, "pitch_deg", "reading") / part_of(quiet, "pitch_deg", "reading"), 100.0,
              0.1);
  EXPECT_NEAR(part_of(loud, "pitch_deg", "fit") / part_of(quiet, "pitch_deg", "fit"), 1.0, 1e-3);
  // A stated noise has infinite degrees of freedom, so if it dominates the coverage factor is 1.96.
  EXPECT_NEAR(by_name(loud).at("pitch_deg").uncertainty.coverage_factor, 1.96, 0.001);
}

// If no temperature is given, the reference temperature is used. An uncertain temperature makes u
// larger.
TEST(BudgetOfAnAttitude, TakesTheReferenceTemperatureIfNoneIsStated) {
  Calibration record = the_budgeted_record();
  record.sensor.temperature = TemperatureResponse{.spans = {{.reference = 20.0}},
                                                  .bias = Eigen::Vector3d::Constant(1e-3),
                                                  .scale = Eigen::Vector3d::Constant(1e-3)};
  const ReadingNoise noise{.temperature_u = 0.5};
  const Eigen::Vector3d f = field_at_deg(record.sensor, 10.0, 10.0);
  const auto u_at = [&](std::optional<double> temperature) {
    return by_name(attitude_budget(record, {}, noise, f, temperature)).at("field_x");
  };
  EXPECT_EQ(u_at(std::nullopt).uncertainty.u, u_at(20.0).uncertainty.u);
  EXPECT_NEAR(u_at(20.0).value, f.x(), 1e-12);
  EXPECT_NEAR(u_at(60.0).value, f.x(), 1e-12);
  EXPECT_GT(u_at(20.0).uncertainty.u,
            by_name(attitude_budget(record, {}, {}, f)).at("field_x").uncertainty.u);
}

// ---- Monte Carlo ----

// With many degrees of freedom Monte Carlo and linear propagation agree.
TEST(MonteCarloOfAnAttitude, AgreesWithTheLinearPropagation) {
  Calibration record = the_budgeted_record();
  record.fit.statistics->degrees_of_freedom.setConstant(1000.0);
  record.fit.statistics->components.clear();
  const Eigen::Vector3d f = field_at_deg(record.sensor, 35.0, -20.0);
  const AttitudeBudget budget = attitude_budget(record, {}, {}, f);
  const std::vector<MonteCarloCheck> checks = check_by_monte_carlo(record, {}, {}, f, 4000, 5);
  ASSERT_EQ(checks.size(), budget.quantities.size());
  for (std::size_t i = 0; i < checks.size(); ++i) {
    const MonteCarloCheck& check = checks[i];
    EXPECT_EQ(check.name, budget.quantities[i].name);
    EXPECT_EQ(check.linear_u, budget.quantities[i].uncertainty.u);
    EXPECT_EQ(check.linear_expanded, budget.quantities[i].uncertainty.expanded);
    EXPECT_LT(check.low_95, 0.0);
    EXPECT_GT(check.high_95, 0.0);
    if (check.name.ends_with("_deg")) {
      EXPECT_NEAR(check.sd / check.linear_u, 1.0, 0.05) << check.name;
      EXPECT_NEAR(check.mean_error / check.linear_u, 0.0, 0.07) << check.name;
      EXPECT_NEAR(check.high_95 / check.linear_expanded, 1.0, 0.1) << check.name;
      EXPECT_TRUE(check.agrees) << check.name;
    }
  }
}

TEST(MonteCarloOfAnAttitude, IsTheSameForTheSameSeed) {
  const Calibration& record = the_budgeted_record();
  const Eigen::Vector3d f = field_at_deg(record.sensor, 35.0, -20.0);
  const auto sd = [&](std::uint64_t seed) {
    return check_by_monte_carlo(record, {}, {}, f, 1000, seed).front().sd;
  };
  EXPECT_EQ(sd(3), sd(3));
  EXPECT_NE(sd(3), sd(4));
  EXPECT_NEAR(sd(3) / sd(4), 1.0, 0.2);
}

// With five degrees of freedom the simulated interval has the width of Student's t.
TEST(MonteCarloOfAnAttitude, HasTheTailsOfStudentsT) {
  Calibration record = the_budgeted_record();
  record.fit.uncertainty.reset();
  record.fit.statistics->components.clear();
  record.fit.statistics->covariance = 1e-14 * Eigen::MatrixXd::Identity(12, 12);
  record.fit.statistics->degrees_of_freedom.setConstant(5.0);
  record.sensor.response.sensitivity = 2.5 * Eigen::Matrix3d::Identity();
  const MonteCarloCheck check =
      check_by_monte_carlo(record, {}, {}, field_at_deg(record.sensor, 0.0, 0.0), 20000, 6).front();
  EXPECT_EQ(check.name, "field_x");
  EXPECT_NEAR(check.high_95 / check.linear_u, t_of_5_degrees, 0.12);
  EXPECT_NEAR(check.low_95 / check.linear_u, -t_of_5_degrees, 0.12);
  EXPECT_NEAR(check.sd / check.linear_u, std::sqrt(5.0 / 3.0), 0.06);
}

TEST(MonteCarloOfAnAttitude, NeedsAThousandTrials) {
  EXPECT_THAT(test::complaint_of<DomainError>([] {
                static_cast<void>(check_by_monte_carlo(the_budgeted_record(), {}, {},
                                                       Eigen::Vector3d::UnitZ(), 999, 1));
              }),
              HasSubstr("at least 1000 trials"));
}

// ---- records without a budget ----

TEST(BudgetOfAnAttitude, NeedsThreeAxesAndAField) {
  const auto complaint = [](const Calibration& record, const ReadingNoise& noise = {}) {
    return test::complaint_of<DomainError>(
        [&] { static_cast<void>(attitude_budget(record, {}, noise, Eigen::Vector3d::UnitZ())); });
  };
  Calibration two = the_budgeted_record();
  two.sensor.instrument.axes.pop_back();
  two.sensor.response.bias = two.sensor.response.bias.head(2).eval();
  two.sensor.response.sensitivity = two.sensor.response.sensitivity.topRows(2).eval();
  FitStatistics& statistics = *two.fit.statistics;
  statistics.parameter_names = parameter_names(two.sensor.instrument.axes);
  statistics.covariance = statistics.covariance.topLeftCorner(8, 8).eval();
  statistics.components.clear();
  statistics.degrees_of_freedom = statistics.degrees_of_freedom.head(2).eval();
  statistics.residual_sd = statistics.residual_sd.head(2).eval();
  two.fit.uncertainty.reset();
  EXPECT_THAT(complaint(two), HasSubstr("at least three axes"));
  Calibration biases = the_budgeted_record();
  biases.fit.method = Method::bias;
  biases.fit.statistics->parameter_names = {"x.bias", "y.bias", "z.bias"};
  EXPECT_THAT(complaint(biases), HasSubstr("biases include"));
  EXPECT_THAT(complaint(the_budgeted_record(), {.sd = Eigen::VectorXd::Ones(2)}),
              HasSubstr("standard deviation"));
  Calibration none = the_budgeted_record();
  none.fit.statistics.reset();
  EXPECT_THAT(complaint(none), HasSubstr("lacks the covariance"));
  EXPECT_EQ(complaint(the_budgeted_record()), "accepted");
}

// A budget may be computed for a refused record. Only Reducer rejects it.
TEST(BudgetOfAnAttitude, IsThereForARefusedRecord) {
  Calibration refused = the_budgeted_record();
  refused.findings.status = CalibrationStatus::refused;
  EXPECT_THROW(Reducer{refused}, RefusedError);
  const Eigen::Vector3d f = field_at_deg(refused.sensor, 10.0, 10.0);
  EXPECT_EQ(attitude_budget(refused, {}, {}, f).quantities.size(),
            attitude_budget(the_budgeted_record(), {}, {}, f).quantities.size());
}

}  // namespace
}  // namespace axiscal
