// SPDX-License-Identifier: Apache-2.0
// Verdicts, compared with closed formulas for one and two degrees of freedom and with random units;
// the file of limits.
#include "axiscal/calib/limits.hpp"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/drift_check.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/units.hpp"
#include "calib/record/parameter_names.hpp"
#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

constexpr double u_of_unit = 2e-3;

// A unit whose parameters all have the standard uncertainty `u_of_unit`.
Calibration unit_under_limits(double nu, const std::string& kind = "generic") {
  Calibration unit;
  unit.sensor = test::truth_of(
      {.bias = Eigen::Vector3d(0.1, -0.2, 0.3), .sensitivity = 2.0 * Eigen::Matrix3d::Identity()},
      kind);
  FitStatistics statistics;
  statistics.observations = 36;
  statistics.parameter_names = parameter_names(unit.sensor.instrument.axes);
  statistics.covariance = u_of_unit * u_of_unit * Eigen::MatrixXd::Identity(12, 12);
  statistics.degrees_of_freedom = Eigen::Vector3d::Constant(nu);
  statistics.residual_sd = Eigen::Vector3d(1e-3, 2e-3, 3e-3);
  unit.fit.statistics = std::move(statistics);
  unit.fit.conditions.blocks = 2;
  return unit;
}

LimitVerdict verdict_on(const Calibration& unit, const Limit& limit, const char* rule = "guarded") {
  return evaluate({.rule = rule, .limits = {limit}}, unit).limits.front();
}

Limits limits_of(const std::string& members) {
  return parse_limits(R"({"format":"axiscal-limits","version":1,)" + members + "}", "l.json");
}

// Student's t with one degree of freedom is the Cauchy distribution.
TEST(Conformity, OfOneDegreeOfFreedomIsByTheArctangent) {
  const Calibration unit = unit_under_limits(1.0);
  const auto below = [](double t) { return 0.5 + std::atan(t) / std::numbers::pi; };
  for (const double t : {-2.0, 0.0, 0.7, 30.0}) {
    const double limit = -0.2 + t * u_of_unit;
    const double high = verdict_on(unit, {.parameter = "y.bias", .high = limit}).conformity;
    const double low = verdict_on(unit, {.parameter = "y.bias", .low = limit}).conformity;
    EXPECT_NEAR(high, below(t), 1e-9);
    EXPECT_NEAR(high + low, 1.0, 1e-12);
  }
  const Limit both{
      .parameter = "x.sensitivity.x", .low = 2.0 - 3.0 * u_of_unit, .high = 2.0 + 0.5 * u_of_unit};
  EXPECT_NEAR(verdict_on(unit, both).conformity, below(0.5) - below(-3.0), 1e-9);
}

// Chi-squared with two degrees of freedom is the exponential distribution.
TEST(Conformity, OfAScatterOfTwoDegreesOfFreedomIsExponential) {
  const Calibration unit = unit_under_limits(2.0);
  for (const double limit : {1e-3, 2e-3, 9e-3}) {
    const LimitVerdict one = verdict_on(unit, {.parameter = "y.residual_sd", .high = limit});
    EXPECT_NEAR(one.conformity, std::exp(-std::pow(2e-3 / limit, 2)), 1e-12);
    EXPECT_NEAR(one.guard_band, 2e-3 * (std::sqrt(-1.0 / std::log(0.95)) - 1.0), 1e-12);
    EXPECT_NEAR(one.u, 2e-3 / 2.0, 1e-15);
  }
  EXPECT_EQ(verdict_on(unit, {.parameter = "y.residual_sd", .high = 0.0}).conformity, 0.0);
}

TEST(Conformity, IsTheSameInAnyUnit) {
  const double factor = 1e5;
  const Calibration unit = unit_under_limits(7.0);
  Calibration other = unit;
  other.sensor.response.bias *= factor;
  other.sensor.response.sensitivity *= factor;
  other.fit.statistics->covariance *= factor * factor;
  other.fit.statistics->residual_sd *= factor;
  for (const char* const parameter : {"z.bias", "x.residual_sd", "y.sensitivity"}) {
    const double value = verdict_on(unit, {.parameter = parameter, .high = 1.0}).value;
    const double limit = value + 1.2e-3;
    const LimitVerdict a = verdict_on(unit, {.parameter = parameter, .high = limit});
    const LimitVerdict b = verdict_on(other, {.parameter = parameter, .high = factor * limit});
    EXPECT_NEAR(a.conformity, b.conformity, 1e-9) << parameter;
    EXPECT_NEAR(factor * a.guard_band, b.guard_band, 1e-9 * b.guard_band) << parameter;
    EXPECT_EQ(a.passed, b.passed) << parameter;
  }
}

// Units exactly at their limit: the guarded rule passes 2.5 % of them, the simple rule 50 %.
TEST(Conformity, GuardsAgainstUnitsOutsideTheirLimits) {
  constexpr int nu = 8;
  constexpr int units = 2000;
  RandomStream random(4);
  Calibration unit = unit_under_limits(nu);
  const double u = 1e-3;
  int guarded = 0;
  int simple = 0;
  double conformity = 0.0;
  for (int i = 0; i < units; ++i) {
    unit.sensor.response.bias(0) = 0.5 + u * random.normal();
    const double ratio = random.normals<nu>().squaredNorm() / nu;
    unit.fit.statistics->covariance(0, 0) = u * u * ratio;
    const Limit limit{.parameter = "x.bias", .high = 0.5};
    const LimitVerdict one = verdict_on(unit, limit);
    guarded += one.passed ? 1 : 0;
    simple += verdict_on(unit, limit, "simple").passed ? 1 : 0;
    conformity += one.conformity / units;
  }
  EXPECT_NEAR(guarded, 0.025 * units, 28);  // tolerance: four standard deviations
  EXPECT_NEAR(simple, 0.5 * units, 90);
  EXPECT_NEAR(conformity, 0.5, 0.03);
}

TEST(LimitRules, TheGuardedOneNeverPassesMore) {
  const Calibration unit = unit_under_limits(10.0);
  const double U = student_t_factor(0.95, 10.0) * u_of_unit;
  for (const double room : {-0.1, 0.5, 0.9, 1.1, 2.0}) {
    const Limit limit{.parameter = "z.sensitivity.z", .low = 2.0 - room * U, .high = 2.0 + 9.0 * U};
    EXPECT_EQ(verdict_on(unit, limit, "simple").passed, room > 0.0);
    EXPECT_EQ(verdict_on(unit, limit).passed, room > 1.0);
    EXPECT_NEAR(verdict_on(unit, limit).guard_band, U, 1e-9);
  }
  // If the limits are closer than two guard bands, no unit passes.
  const Limit narrow{.parameter = "z.sensitivity.z", .low = 2.0 - 0.9 * U, .high = 2.0 + 0.9 * U};
  EXPECT_FALSE(verdict_on(unit, narrow).passed);
}

TEST(LimitRules, CountWithoutUncertaintyIfTheRecordStatesNone) {
  Calibration unit = unit_under_limits(10.0);
  unit.fit.statistics.reset();
  const LimitVerdict one = verdict_on(unit, {.parameter = "x.bias", .high = 0.1});
  EXPECT_TRUE(one.passed);
  EXPECT_EQ(one.guard_band, 0.0);
  EXPECT_TRUE(std::isnan(one.u));
  EXPECT_TRUE(std::isnan(one.conformity));
}

TEST(LimitRules, TakeAngleLengthAndLevelness) {
  Calibration unit = unit_under_limits(5.0);
  const double angle = 1.5;
  unit.sensor.response.sensitivity.row(1) << 4.0 * std::cos(angle), 4.0 * std::sin(angle), 0.0;
  unit.fit.levelness = Levelness{.mean_x = 3e-4,
                                 .mean_y = -2e-4,
                                 .standard_error_x = 1e-4,
                                 .standard_error_y = 2e-4,
                                 .degrees_of_freedom = 1.0};
  EXPECT_NEAR(verdict_on(unit, {.parameter = "angle.x.y", .low = 1.0}).value, angle, 1e-12);
  EXPECT_NEAR(verdict_on(unit, {.parameter = "y.sensitivity", .low = 1.0}).value, 4.0, 1e-12);
  const LimitVerdict level = verdict_on(unit, {.parameter = "levelness.x", .high = 4e-4});
  EXPECT_EQ(level.guard_band, 2e-4);
  EXPECT_FALSE(level.passed);
  EXPECT_NEAR(level.conformity, 0.75, 1e-9);  // P(Cauchy < 1)
}

TEST(LimitRules, CountReadingsAndDesignPoints) {
  Calibration unit = unit_under_limits(5.0);
  const DesignPoint one(Face::plus_x, Face::plus_y);
  for (const DesignPoint& point : {one, one, one.turned_round()}) {
    unit.fit.residuals.push_back({.point = point});
  }
  unit.fit.residuals.push_back({.point = DesignPoint(Face::plus_z, Face::plus_y), .used = false});
  const LimitVerdict readings = verdict_on(unit, {.parameter = "readings", .low = 37.0});
  EXPECT_EQ(readings.value, 36.0);
  EXPECT_FALSE(readings.passed);
  EXPECT_TRUE(verdict_on(unit, {.parameter = "design_points", .low = 2.0, .high = 2.0}).passed);
}

TEST(LimitRules, ApplyToACheck) {
  const Calibration unit = unit_under_limits(5.0);
  const DriftCheck check{.p_value = 0.02,
                         .pitch_error_deg = 0.30,
                         .pitch_error_u_deg = 0.05,
                         .pitch_error_expanded_deg = 0.15};
  const Limits limits{.rule = "guarded",
                      .limits = {{.parameter = "drift_p_value", .low = 0.01},
                                 {.parameter = "pitch_error_deg", .high = 0.4}}};
  const Verdict verdict = evaluate(limits, unit, &check);
  EXPECT_TRUE(verdict.limits[0].passed);
  EXPECT_EQ(verdict.limits[0].guard_band, 0.0);
  EXPECT_FALSE(verdict.limits[1].passed);
  EXPECT_FALSE(verdict.passed);
  EXPECT_EQ(reason_of(verdict), "pitch_error_deg = 0.3 is above 0.4 less the guard band 0.15");
  EXPECT_THAT(test::complaint_of<DomainError>([&] { static_cast<void>(evaluate(limits, unit)); }),
              HasSubstr("limit 'drift_p_value': the record has no such parameter"));
}

// Only the biases are uncertain. Each component has the uncertainty u / S, and so has the pitch in
// every attitude.
TEST(LimitRules, KnowTheUncertaintyOfAnAccelerometersPitch) {
  Calibration unit = unit_under_limits(1e9, "accelerometer");
  for (const Eigen::Index k : {0, 4, 8}) {
    unit.fit.statistics->covariance.diagonal().segment<3>(k + 1).setZero();
  }
  const double expected = 1.959964 * u_of_unit / 2.0 * deg_per_rad;
  const LimitVerdict one =
      verdict_on(unit, {.parameter = "pitch_error_deg", .high = 1.0}, "simple");
  EXPECT_NEAR(one.value / expected, 1.0, 0.01);
}

TEST(ReasonOf, NamesEachLimitThatIsNotMet) {
  Calibration unit = unit_under_limits(5.0);
  const auto reason = [&](const Limits& limits) { return reason_of(evaluate(limits, unit)); };
  EXPECT_EQ(reason({.limits = {{.parameter = "x.bias", .low = 0.0}}}), "");
  EXPECT_EQ(reason({.limits = {{.parameter = "x.bias", .low = 0.2},
                               {.parameter = "z.bias", .high = 0.4},
                               {.parameter = "y.bias", .high = -0.25}}}),
            "x.bias = 0.1 is below 0.2; y.bias = -0.2 is above -0.25");
  EXPECT_THAT(reason({.rule = "guarded", .limits = {{.parameter = "x.bias", .low = 0.1}}}),
              HasSubstr("is below 0.1 plus the guard band"));
  unit.fit.conditions.blocks = 1;
  EXPECT_THAT(reason({.rule = "guarded",
                      .intermediate = true,
                      .limits = {{.parameter = "x.bias", .low = 0.0}}}),
              HasSubstr("x.bias = 0.1 is from only one block"));
  unit.fit.conditions.earlier = 3;  // earlier records give the scatter of blocks
  EXPECT_EQ(reason({.rule = "guarded",
                    .intermediate = true,
                    .limits = {{.parameter = "x.bias", .low = 0.0}}}),
            "");
  unit.fit.statistics->residual_sd(0) = std::nan("");
  EXPECT_THAT(reason({.limits = {{.parameter = "x.residual_sd", .high = 1.0}}}),
              HasSubstr("is not known"));
}

TEST(LimitNames, OfARecordAreSuggestedOrListed) {
  const Calibration unit = unit_under_limits(5.0);
  const auto complaint_on = [&](const char* parameter) {
    return test::complaint_of<DomainError>(
        [&] { static_cast<void>(verdict_on(unit, {.parameter = parameter, .high = 1.0})); });
  };
  EXPECT_THAT(complaint_on("x.bios"), HasSubstr("x.bias"));
  EXPECT_THAT(complaint_on("quite another"), HasSubstr("it has x.bias, x.sensitivity.x"));
}

TEST(LimitNames, DependOnTheAxes) {
  const std::vector<std::string> axes = {"u", "acc_v"};
  for (const char* const name :
       {"u.bias", "acc_v.bias.d2", "u.sensitivity", "acc_v.sensitivity.z", "u.scale.d",
        "acc_v.residual_sd", "angle.u.acc_v", "readings", "design_points", "levelness.y",
        "pitch_error_deg", "drift_p_value"}) {
    EXPECT_TRUE(is_limit_parameter(name, axes)) << name;
  }
  for (const char* const name : {"x.bias", "v.bias", "u", "u.sd", "u.residual_sd.x", "bias", ""}) {
    EXPECT_FALSE(is_limit_parameter(name, axes)) << name;
  }
}

TEST(LimitsFile, IsReadAsItStands) {
  const test::ScratchFolder folder;
  const std::string path = folder.write("limits.json", R"({"format": "axiscal-limits", "version": 1,
      "rule": "guarded", "conditions": "intermediate",
      "limits": [{"parameter": "x.bias", "low": -0.5, "high": 0.5},
                 {"parameter": "angle.x.y", "low": 1.5}]})");
  const Limits limits = read_limits(path);
  EXPECT_EQ(limits.path, path);
  EXPECT_EQ(limits.rule, "guarded");
  EXPECT_TRUE(limits.intermediate);
  ASSERT_EQ(limits.limits.size(), 2U);
  EXPECT_EQ(limits.limits[0].low, -0.5);
  EXPECT_EQ(limits.limits[0].high, 0.5);
  EXPECT_EQ(limits.limits[1].parameter, "angle.x.y");
  EXPECT_FALSE(limits.limits[1].high);
  EXPECT_THROW(static_cast<void>(read_limits(folder.path("none.json"))), DataError);
  const Limits plain = limits_of(R"("limits":[{"parameter":"a","low":2,"high":2}])");
  EXPECT_EQ(plain.rule, "simple");
  EXPECT_FALSE(plain.intermediate);
}

TEST(LimitsFile, IsRefusedWithThePlaceOfTheError) {
  const auto complaint_about = [](const std::string& members) {
    return test::complaint_of<DataError>([&] { static_cast<void>(limits_of(members)); });
  };
  const std::string good = R"("limits":[{"parameter":"x.bias","high":1}])";
  EXPECT_EQ(complaint_about(good), "accepted");
  EXPECT_EQ(complaint_about(R"("rule":"best",)" + good),
            "l.json: /rule: must be 'simple' or 'guarded'");
  EXPECT_EQ(complaint_about(R"("conditions":"some",)" + good),
            "l.json: /conditions: must be 'repeatability' or 'intermediate'");
  EXPECT_EQ(complaint_about(R"("limits":[])"), "l.json: /limits: must contain at least one limit");
  const std::string first = R"("limits":[{"parameter":"a","low":1},)";
  EXPECT_EQ(complaint_about(first + R"({"parameter":"b"}])"),
            "l.json: /limits/1: a limit requires 'low' or 'high'");
  EXPECT_EQ(complaint_about(first + R"({"parameter":"b","low":2,"high":1}])"),
            "l.json: /limits/1: 'low' must not be above 'high'");
  EXPECT_THAT(complaint_about(first + R"({"parameter":"b","height":1}])"), HasSubstr("height"));
  EXPECT_THAT(complaint_about(first + R"({"low":1}])"), HasSubstr("/limits/1"));
}

}  // namespace
}  // namespace axiscal
