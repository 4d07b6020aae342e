// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <Eigen/Geometry>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/custom_field.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using test::accelerometer_truth;
using test::experiment_for;
using test::observe;
using testing::Contains;
using testing::HasSubstr;

Eigen::Vector3d tilted(double x, double y) {
  return {x, y, std::sqrt(1.0 - x * x - y * y)};
}

std::vector<std::string_view> codes(const Calibration& calibration) {
  std::vector<std::string_view> result;
  for (const CalibrationWarning& warning : calibration.findings.warnings) {
    result.push_back(warning_name(warning.code));
  }
  return result;
}

Observations without_runs(Observations observations, const std::vector<int>& runs) {
  Observations kept = observations;
  kept.readings.clear();
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const int run = observations.readings[i].run;
    if (std::find(runs.begin(), runs.end(), run) == runs.end()) {
      kept.readings.push_back(observations.readings[i]);
      kept.response.row(row++) = observations.response.row(static_cast<Eigen::Index>(i));
    }
  }
  kept.response.conservativeResize(row, Eigen::NoChange);
  return kept;
}

int run_at(const Observations& observations, const DesignPoint& point) {
  for (const Reading& reading : observations.readings) {
    if (reading.point == point) {
      return reading.run;
    }
  }
  return 0;
}

// ---- without noise the truth comes back ----

using ExactCase = std::tuple<Method, int, int, double, double>;  // points, replicates, slope deg
class Exact : public testing::TestWithParam<ExactCase> {};

TEST_P(Exact, ReturnsTheTruth) {
  const auto [method, points, replicates, x_deg, y_deg] = GetParam();
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = method;
  const Eigen::Vector2d slope(std::sin(x_deg * rad_per_deg), std::sin(y_deg * rad_per_deg));
  if (method == Method::known) {
    experiment.table.slope = slope;
  }
  const Calibration result = calibrate(
      experiment, observe(truth, {.points = points, .replicates = replicates, .slope = slope}));
  EXPECT_MATRIX_NEAR(result.sensor.response.bias, truth.response.bias, 1e-12);
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-12);
  EXPECT_MATRIX_NEAR(*result.sensor.field.in_table, tilted(slope.x(), slope.y()), 1e-12);
  EXPECT_EQ(result.findings.status, CalibrationStatus::ok) << testing::PrintToString(codes(result));
  ASSERT_TRUE(result.fit.levelness);
  EXPECT_EQ(result.fit.levelness->estimates.size(), static_cast<std::size_t>(6 * replicates));
  EXPECT_NEAR(result.fit.levelness->mean_x, slope.x(), 1e-12);
  EXPECT_NEAR(result.fit.levelness->mean_y, slope.y(), 1e-12);
  EXPECT_TRUE(result.fit.levelness->consistent);
  for (const ReadingResidual& residual : result.fit.residuals) {
    EXPECT_MATRIX_NEAR(residual.response, Eigen::Vector3d::Zero(), 1e-12);
    EXPECT_NEAR(residual.magnitude, 0.0, 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Slopes,
    Exact,
    testing::Combine(testing::Values(Method::paired, Method::joint, Method::known),
                     testing::Values(12, 24),
                     testing::Values(1, 2),
                     testing::Values(0.0, 0.3, -2.0),
                     testing::Values(0.0, 1.4)));

TEST(Calibrate, TakesArraysAsItTakesObservations) {
  const SensorModel truth = accelerometer_truth();
  const Experiment experiment = experiment_for(truth);
  const Observations observations = simulate(truth, make_run_sheet(standard_design(12), 1, 3),
                                             {.noise_sd = 1e-4, .slope = {2e-3, 1e-3}});
  std::vector<DesignPoint> points;
  for (const Reading& reading : observations.readings) {
    points.push_back(*reading.point);
  }
  const Calibration full = calibrate(experiment, observations);
  const Calibration by_arrays = calibrate(experiment, points, observations.response);
  EXPECT_EQ(by_arrays.sensor.response.bias, full.sensor.response.bias);
  EXPECT_EQ(by_arrays.sensor.response.sensitivity, full.sensor.response.sensitivity);
  EXPECT_EQ(by_arrays.fit.residuals.back().run, 12);
  points.pop_back();
  EXPECT_THROW(static_cast<void>(calibrate(experiment, points, observations.response)),
               DomainError);
}

TEST(Calibrate, SixPointsAreEnoughOnAKnownTable) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::known;
  const Calibration result = calibrate(experiment, observe(truth, {.points = 6}));
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-13);
  EXPECT_FALSE(result.fit.levelness);
  EXPECT_EQ(result.fit.statistics->degrees_of_freedom, Eigen::VectorXd::Constant(3, 2.0));
}

TEST(Calibrate, SixPointsOnATiltedTableAreDeterminedButWarnedOf) {
  const SensorModel truth = accelerometer_truth();
  const Calibration result =
      calibrate(experiment_for(truth), observe(truth, {.points = 6, .slope = {0.05, 0.03}}));
  EXPECT_EQ(result.fit.method, Method::joint);
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-9);
  // The condition number is proportional to 1 / slope (method.md, section 4). Here it is 2.9 /
  // slope along y.
  EXPECT_NEAR(result.fit.statistics->condition_number * 0.03, 2.9, 0.2);
  EXPECT_THAT(codes(result), Contains("ill_conditioned"));
}

TEST(Calibrate, SevenPointsAreDeterminedOnALevelTable) {
  const SensorModel truth = accelerometer_truth();
  Observations observations = observe(truth, {.points = 12});
  std::vector<int> leave;
  for (const Face rest : all_faces) {
    if (rest != Face::plus_x) {
      leave.push_back(run_at(observations, {rest, face_of((axis_of(rest) + 1) % 3, false)}));
    }
  }
  const Calibration result = calibrate(experiment_for(truth), without_runs(observations, leave));
  EXPECT_EQ(result.fit.statistics->observations, 7);
  EXPECT_EQ(result.fit.method, Method::joint);
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-11);
  // The condition number is 4.5 if one of six points is repeated with the cube turned round
  // (method.md, section 4).
  EXPECT_LT(result.fit.statistics->condition_number, 6.0);
}

TEST(Calibrate, TakesAnySubsetThatDeterminesTheModel) {
  const SensorModel truth = accelerometer_truth();
  const Observations all = observe(truth, {.points = 24, .replicates = 2, .slope = {0.01, 0.02}});
  const Calibration result =
      calibrate(experiment_for(truth), without_runs(all, {2, 3, 11, 17, 30, 31, 32, 48}));
  EXPECT_EQ(result.fit.method, Method::joint);
  EXPECT_EQ(result.fit.statistics->observations, 40);
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-12);
}

TEST(Calibrate, PairedLeavesOutWhatHasNoOppositeAndSaysSo) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::paired;
  const Observations all = observe(truth, {.replicates = 2, .slope = {0.01, 0.02}});
  const Calibration result = calibrate(experiment, without_runs(all, {5}));
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-12);
  ASSERT_EQ(codes(result), std::vector<std::string_view>{"unpaired"});
  EXPECT_EQ(result.findings.warnings[0].runs.size(), 1U);
  EXPECT_EQ(result.findings.status, CalibrationStatus::warning);
  EXPECT_EQ(result.fit.statistics->observations, 22);
  int used = 0;
  for (const ReadingResidual& residual : result.fit.residuals) {
    used += residual.used ? 1 : 0;
  }
  EXPECT_EQ(used, 22);
  // 11 averages less 4 coefficients and one shift between two blocks.
  EXPECT_EQ(result.fit.statistics->degrees_of_freedom(0), 6.0);
}

TEST(Calibrate, LeavesOutRunsOnRequest) {
  const SensorModel truth = accelerometer_truth();
  Observations observations = observe(truth, {.replicates = 2});
  observations.response(4, 0) += 1.0;
  Experiment experiment = experiment_for(truth);
  experiment.leave_out = {observations.readings[4].run};
  const Calibration result = calibrate(experiment, observations);
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-12);
  EXPECT_EQ(result.fit.left_out, experiment.leave_out);
  ASSERT_EQ(result.fit.residuals.size(), 24U);
  EXPECT_FALSE(result.fit.residuals[4].used);
  EXPECT_NEAR(result.fit.residuals[4].response(0), 1.0, 1e-12);
  experiment.leave_out = {99};
  EXPECT_THROW(static_cast<void>(calibrate(experiment, observations)), SetupError);
}

// ---- instruments with other numbers of axes ----

class AnyAxes : public testing::TestWithParam<int> {};

TEST_P(AnyAxes, ReturnTheTruth) {
  const int m = GetParam();
  LinearResponse response{.bias = Eigen::VectorXd::LinSpaced(m, -0.2, 0.3),
                          .sensitivity = SensitivityMatrix::Zero(m, 3)};
  for (int k = 0; k < m; ++k) {
    response.sensitivity.row(k) << 0.02 * k, -0.03, 0.01;
    response.sensitivity(k, k % 3) += 1.0 + 0.1 * k;
  }
  const SensorModel truth = test::truth_of(response, m < 3 ? "inclinometer" : "generic");
  for (const Method method : {Method::paired, Method::joint}) {
    Experiment experiment = experiment_for(truth);
    experiment.fit.method = method;
    const Calibration result =
        calibrate(experiment, observe(truth, {.replicates = 2, .slope = {0.004, -0.007}}));
    EXPECT_MATRIX_NEAR(result.sensor.response.bias, truth.response.bias, 1e-12);
    EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-12);
    ASSERT_TRUE(result.fit.levelness) << m;
    EXPECT_NEAR(result.fit.levelness->mean_x, 0.004, 1e-12);
    EXPECT_NEAR(result.fit.levelness->mean_y, -0.007, 1e-12);
    EXPECT_EQ(result.fit.residuals[0].magnitude == result.fit.residuals[0].magnitude, m >= 3)
        << "NaN for fewer than three axes";
    // For two axes both slopes can be estimated only if the third axis is along the table's normal.
    const std::size_t estimates = m >= 3 ? 12U : m == 2 ? 4U : 0U;
    EXPECT_EQ(result.fit.levelness->estimates.size(), estimates);
  }
}

INSTANTIATE_TEST_SUITE_P(Counts, AnyAxes, testing::Values(1, 2, 3, 4, 6));

// ---- degrees of freedom and standard errors ----

// Each block except one adds a column, the shift of its biases.
TEST(Calibrate, HasTheStatedDegreesOfFreedom) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.seats = SeatSetup::none;
  const auto dof = [&](Method method, int replicates) {
    experiment.fit.method = method;
    return calibrate(experiment, observe(truth, {.replicates = replicates, .noise_sd = 1e-4}))
        .fit.statistics->degrees_of_freedom;
  };
  EXPECT_EQ(dof(Method::paired, 1), Eigen::VectorXd::Constant(3, 2.0));
  EXPECT_EQ(dof(Method::paired, 2), Eigen::VectorXd::Constant(3, 7.0));
  EXPECT_EQ(dof(Method::known, 1), Eigen::VectorXd::Constant(3, 8.0));
  EXPECT_NEAR(dof(Method::joint, 1).sum(), 22.0, 1e-9);
  EXPECT_NEAR(dof(Method::joint, 3).sum(), 3 * 36 - 14.0 - 6.0, 1e-9);
}

// For r whole designs var b = sigma^2 / 12r and var S = sigma^2 / 4rF^2 (method.md, section 4). The
// variance of b also includes the scatter between the two blocks.
TEST(Calibrate, HasTheStatedStandardErrors) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.seats = SeatSetup::none;
  for (const Method method : {Method::paired, Method::joint, Method::known}) {
    experiment.fit.method = method;
    const FitStatistics statistics =
        *calibrate(experiment, observe(truth, {.replicates = 2, .noise_sd = 1e-4})).fit.statistics;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double s = statistics.residual_sd(k);
      EXPECT_GE(statistics.bias_se(k), (1.0 - 1e-4) * s / std::sqrt(24.0));
      // The table is level, and the fitted slope is noise. Its square changes these values.
      for (Eigen::Index j = 0; j < 3; ++j) {
        EXPECT_NEAR(statistics.sensitivity_se(k, j), s / std::sqrt(8.0), 1e-4 * s);
        EXPECT_NEAR(statistics.variance_inflation(k, j), 1.0, 1e-6);
      }
      EXPECT_EQ(statistics.coverage_factor(k),
                student_t_factor(0.95, statistics.degrees_of_freedom(k)));
    }
    EXPECT_NEAR(statistics.condition_number, 1.0, 1e-3);
    EXPECT_EQ(statistics.parameter_names[1], "x.sensitivity.x");
    EXPECT_EQ(statistics.parameter_names.size(), 12U);
  }
}

// Each tangent [rad] has the variance 1 / (4r sum |S_k|^2 / sigma_k^2), multiplied by the factor
// for estimated weights (method.md, section 4).
TEST(Calibrate, JointStatesTheUncertaintyOfTheDirection) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::joint;
  const Calibration result =
      calibrate(experiment, observe(truth, {.slope = {0.01, 0.0}, .noise_sd = 1e-4}));
  const FitStatistics& statistics = *result.fit.statistics;
  const Eigen::ArrayXd information =
      result.sensor.response.sensitivity.rowwise().squaredNorm().array() /
      statistics.residual_sd.array().square();
  const Eigen::ArrayXd p = information / information.sum();
  const Eigen::ArrayXd nu = statistics.degrees_of_freedom.array();
  const double factor = 1.0 + 4.0 * (p * (1.0 - p) / nu).sum();
  ASSERT_TRUE(result.sensor.field.in_table_covariance);
  EXPECT_NEAR((*result.sensor.field.in_table_covariance)(0, 0) * 4.0 * information.sum() / factor,
              1.0, 1e-3);
  EXPECT_NEAR(result.sensor.field.in_table_degrees_of_freedom, 1.0 / (p.square() / nu).sum(), 1e-9);
}

TEST(Calibrate, WeighsRepeatsAsTheirMean) {
  // Three readings of one point have the effect of one reading with weight 3.
  const SensorModel truth = accelerometer_truth();
  Observations single = observe(truth, {.noise_sd = 1e-3, .seed = 8});
  Observations repeated = single;
  single.samples = Eigen::VectorXd::Ones(12);
  (*single.samples)(3) = 3.0;
  for (int copy = 0; copy < 2; ++copy) {
    Reading reading = repeated.readings[3];
    reading.run = 13 + copy;
    repeated.readings.push_back(reading);
    repeated.response.conservativeResize(13 + copy, Eigen::NoChange);
    constexpr double apart = 1e-7;  // equal rows would be left out as copies
    repeated.response.row(12 + copy) =
        repeated.response.row(3).array() + (copy == 0 ? apart : -apart);
  }
  for (const Method method : {Method::paired, Method::known}) {
    Experiment experiment = experiment_for(truth);
    experiment.fit.method = method;
    const Calibration a = calibrate(experiment, single);
    const Calibration b = calibrate(experiment, repeated);
    EXPECT_EQ(a.fit.weights, Weighting::samples);
    EXPECT_EQ(b.fit.weights, Weighting::none);
    EXPECT_MATRIX_NEAR(a.sensor.response.sensitivity, b.sensor.response.sensitivity, 1e-12);
    EXPECT_MATRIX_NEAR(a.sensor.response.bias, b.sensor.response.bias, 1e-12);
  }
}

TEST(Calibrate, WeighsEachAxisByItsOwnSd) {
  const SensorModel truth = accelerometer_truth();
  Observations observations = observe(truth, {.replicates = 2, .noise_sd = 1e-3, .seed = 9});
  observations.response_sd = Eigen::MatrixXd::Constant(24, 3, 0.01);
  observations.response_sd->row(7) << 1e3, 0.01, 0.01;  // weight of axis x in one reading: nearly 0
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::known;
  experiment.fit.weighting = Weighting::sd;
  const Calibration weighted = calibrate(experiment, observations);
  experiment.fit.weighting = Weighting::none;
  const Calibration plain = calibrate(experiment, observations);
  experiment.leave_out = {observations.readings[7].run};
  const Calibration without = calibrate(experiment, observations);
  EXPECT_MATRIX_NEAR(weighted.sensor.response.sensitivity.row(0),
                     without.sensor.response.sensitivity.row(0),
                     5e-6);  // the noise is 1e-3
  EXPECT_MATRIX_NEAR(weighted.sensor.response.sensitivity.row(1),
                     plain.sensor.response.sensitivity.row(1), 1e-13);
  EXPECT_GT((weighted.sensor.response.sensitivity.row(0) - plain.sensor.response.sensitivity.row(0))
                .norm(),
            1e-6);
}

TEST(Calibrate, PairedAgreesWithJoint) {
  const SensorModel truth = accelerometer_truth();
  const Observations observations =
      observe(truth, {.replicates = 3, .slope = {0.01, -0.006}, .noise_sd = 1e-4, .seed = 4});
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::paired;
  const Calibration paired = calibrate(experiment, observations);
  experiment.fit.method = Method::joint;
  const Calibration joint = calibrate(experiment, observations);
  // They differ by at most noise times tilt (method.md, section 4).
  EXPECT_MATRIX_NEAR(paired.sensor.response.sensitivity, joint.sensor.response.sensitivity, 5e-6);
  EXPECT_MATRIX_NEAR(paired.sensor.response.bias, joint.sensor.response.bias, 1e-6);
  EXPECT_MATRIX_NEAR(*paired.sensor.field.in_table, *joint.sensor.field.in_table, 1e-5);
}

// Readings with coarse steps are equal in all digits. Rounding errors in sums of squares must not
// become a pure error.
TEST(Calibrate, FindsNoPureErrorInReadingsThatAreAllTheSame) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U, 6U}) {
    Observations observations =
        observe(truth, {.replicates = 3, .slope = {0.004, -0.003}, .noise_sd = 1e-7, .seed = seed});
    for (double& v : observations.response.reshaped()) {
      constexpr double step = 0.0121;
      v = step * std::round(v / step);
    }
    for (const Method method : {Method::paired, Method::joint, Method::known}) {
      experiment.fit.method = method;
      const Calibration calibration = calibrate(experiment, observations);
      for (const LackOfFit& test : calibration.fit.statistics->lack_of_fit) {
        EXPECT_EQ(test.pure_error_sd, 0.0) << method_name(method) << ", seed " << seed;
      }
    }
  }
}

// The three shifts between four blocks reduce the degrees of freedom of the pure error.
TEST(Calibrate, SplitsPureErrorFromLackOfFit) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.seats = SeatSetup::none;
  for (const Method method : {Method::paired, Method::joint, Method::known}) {
    experiment.fit.method = method;
    Observations observations = observe(truth, {.replicates = 4, .noise_sd = 1e-4, .seed = 2});
    const Calibration good = calibrate(experiment, observations);
    ASSERT_EQ(good.fit.statistics->lack_of_fit.size(), 3U);
    const LackOfFit& test = good.fit.statistics->lack_of_fit[0];
    EXPECT_EQ(test.pure_error_dof, method == Method::paired ? 15.0 : 33.0);
    EXPECT_NEAR(test.pure_error_dof + test.lack_of_fit_dof,
                good.fit.statistics->degrees_of_freedom(0), 1e-12);
    EXPECT_NEAR(test.pure_error_sd, 1e-4, 5e-5);
    EXPECT_GT(test.p_value, 0.01);
    // A squared term is equal in all repeats, so it is lack of fit and not pure error.
    for (double& v : observations.response.reshaped()) {
      v += 2e-3 * v * v;
    }
    const Calibration bent = calibrate(experiment, observations);
    EXPECT_LT(bent.fit.statistics->lack_of_fit[0].p_value, 1e-6);
    EXPECT_THAT(codes(bent), Contains("lack_of_fit"));
  }
}

// ---- fields ----

// Six points determine the direction of the field and the coefficients of one axis, and leave no
// degree of freedom for lack of fit.
TEST(Calibrate, TestsNoLackOfFitByRounding) {
  LinearResponse response;
  response.bias = Eigen::VectorXd::Constant(1, 0.02);
  response.sensitivity = Eigen::RowVector3d(-0.08, -0.017, 2.5);
  const SensorModel truth = test::truth_of(response);
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::joint;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Calibration found = calibrate(
        experiment, observe(truth, {.points = 6, .replicates = 2, .noise_sd = 2e-4, .seed = seed}));
    // 12 readings less four coefficients, two tangents of the direction and one shift between the
    // blocks.
    ASSERT_EQ(found.fit.statistics->degrees_of_freedom(0), 5.0) << seed;
    const LackOfFit& test = found.fit.statistics->lack_of_fit.at(0);
    EXPECT_EQ(test.lack_of_fit_dof, 0.0) << seed;
    EXPECT_TRUE(std::isnan(test.p_value)) << seed;
  }
}

// A reading outside the instrument's range is ignored, so its value does not change the result.
TEST(Calibrate, IsTheSameWhateverStandsBeyondTheRange) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.instrument.range = ReadingRange{.low = -10.0, .high = 10.0};
  Observations observations =
      observe(truth, {.points = 24, .replicates = 2, .noise_sd = 2e-4, .seed = 3});
  std::optional<Calibration> first;
  for (const double full : {12.0, 1e12, 9.9e37}) {
    observations.response(3, 0) = full;
    observations.response(17, 1) = -full;
    const Calibration found = calibrate(experiment, observations);
    first = first.value_or(found);
    EXPECT_TRUE(
        found.fit.statistics->residual_sd.isApprox(first->fit.statistics->residual_sd, 1e-9));
    EXPECT_TRUE(found.fit.statistics->bias_se.isApprox(first->fit.statistics->bias_se, 1e-9));
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(found.fit.statistics->lack_of_fit[k].p_value,
                  first->fit.statistics->lack_of_fit[k].p_value, 1e-6);
    }
    EXPECT_EQ(codes(found), codes(*first));
  }
}

TEST(Calibrate, TakesGravityInSiUnitsAtASite) {
  SensorModel truth = accelerometer_truth();
  // Normal gravity by Somigliana's formula with the WGS 84 constants at 45 degrees.
  truth.field = {.kind = "gravity", .unit = "m/s^2", .magnitude = 9.806197769377};
  const Observations observations = observe(truth, {});
  Experiment experiment;
  experiment.instrument = truth.instrument;
  experiment.field.of = make_field("gravity");
  experiment.field.unit = "m/s^2";
  EXPECT_THROW(static_cast<void>(calibrate(experiment, observations)), SetupError);
  experiment.table.site = Site{.latitude_deg = 45.0};
  const Calibration result = calibrate(experiment, observations);
  EXPECT_NEAR(result.sensor.field.magnitude, 9.806197769377, 1e-9);
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-9);
}

TEST(Calibrate, TakesACustomFieldAtAnyAngle) {
  for (const Eigen::Vector3d& direction :
       {Eigen::Vector3d(3.0, 0.0, 0.0), Eigen::Vector3d(1.0, -2.0, -2.0),
        Eigen::Vector3d(0.0, 0.1, 5.0)}) {
    SensorModel truth = accelerometer_truth();
    truth.instrument.kind = "generic";
    truth.field = {
        .kind = "custom", .unit = "uT", .magnitude = direction.norm(), .in_table = direction};
    const Observations observations = observe(truth, {});
    Experiment experiment = experiment_for(truth);
    experiment.field.magnitude.reset();
    // The start is off by 40 degrees. Its length is the magnitude of the field.
    const Eigen::Vector3d off = tangents_of(direction).col(0);
    experiment.field.in_table =
        direction.norm() *
        (std::cos(0.7) * direction.normalized() + std::sin(0.7) * off).normalized();
    const Calibration joint = calibrate(experiment, observations);
    EXPECT_EQ(joint.fit.method, Method::joint);
    EXPECT_MATRIX_NEAR(*joint.sensor.field.in_table, direction, 1e-11);
    EXPECT_MATRIX_NEAR(joint.sensor.response.sensitivity, truth.response.sensitivity, 1e-11);
    EXPECT_EQ(joint.findings.status, CalibrationStatus::ok);
    experiment.field.in_table = direction;
    experiment.fit.method = Method::known;
    const Calibration known = calibrate(experiment, observations);
    EXPECT_MATRIX_NEAR(known.sensor.response.sensitivity, truth.response.sensitivity, 1e-12);
  }
}

TEST(Calibrate, TakesAFieldThatIsSetByItsLevel) {
  SensorModel truth = accelerometer_truth();
  truth.instrument.kind = "generic";
  truth.field = {.kind = "custom", .magnitude = 2.0, .in_table = Eigen::Vector3d(0.0, 0.0, 2.0)};
  std::vector<DesignEntry> design = standard_design(12);
  for (const double level : {0.0, -1.0}) {
    for (DesignEntry entry : standard_design(12)) {
      entry.level = level;
      design.push_back(entry);
    }
  }
  const Observations observations =
      simulate(truth, make_run_sheet(design, 1, 1), {.slope = {0.01, 0.005}});
  for (const Method method : {Method::paired, Method::joint}) {
    Experiment experiment = experiment_for(truth);
    experiment.fit.method = method;
    const Calibration result = calibrate(experiment, observations);
    EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-12);
    EXPECT_EQ(result.findings.status, CalibrationStatus::ok);
  }
  Experiment gravity = experiment_for(accelerometer_truth());
  EXPECT_THROW(static_cast<void>(calibrate(gravity, observations)), RefusedError);
}

// A field class that a user of the library writes.
class Centrifuge final : public ReferenceField {
 public:
  [[nodiscard]] Eigen::Vector3d value_in_enu() const override { return {0.0, 20.0, 9.8}; }
  [[nodiscard]] std::string_view unit() const override { return "m/s^2"; }
  [[nodiscard]] std::string_view kind() const override { return "centrifuge"; }
};

TEST(Calibrate, TakesAUsersOwnField) {
  SensorModel truth = accelerometer_truth();
  truth.field = {.kind = "centrifuge",
                 .unit = "m/s^2",
                 .magnitude = Centrifuge().magnitude(),
                 .in_table = Centrifuge().value_in_enu()};
  const Observations observations = observe(truth, {});
  Experiment experiment;
  experiment.instrument = truth.instrument;
  experiment.field = std::make_shared<Centrifuge>();
  const Calibration result = calibrate(experiment, observations);
  EXPECT_EQ(result.sensor.field.kind, "centrifuge");
  EXPECT_EQ(result.fit.method, Method::joint);
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-12);
}

TEST(Calibrate, RefusesAMagnitudeBesideAUsersOwnField) {
  SensorModel truth = accelerometer_truth();
  const Observations observations = observe(truth, {});
  Experiment experiment;
  experiment.instrument = truth.instrument;
  experiment.field = std::make_shared<Centrifuge>();
  experiment.field.magnitude = 2.0 * Centrifuge().magnitude();
  EXPECT_THAT(test::complaint_of<SetupError>(
                  [&] { static_cast<void>(calibrate(experiment, observations)); }),
              testing::HasSubstr("remove the magnitude 44.5439"));
}

TEST(Calibrate, SaysWhatItTookForTheMagnitude) {
  const SensorModel truth = accelerometer_truth();
  const Observations observations = observe(truth, {.noise_sd = 1e-4});
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::joint;
  experiment.field.magnitude.reset();
  experiment.field.in_table = Eigen::Vector3d(0.0, 0.1, 0.93);
  const Calibration doubtful = calibrate(experiment, observations);
  const auto of_length = std::find_if(
      doubtful.findings.warnings.begin(), doubtful.findings.warnings.end(),
      [](const CalibrationWarning& warning) { return warning.code == WarningCode::field_length; });
  ASSERT_NE(of_length, doubtful.findings.warnings.end());
  EXPECT_THAT(of_length->message, testing::HasSubstr("set the magnitude to 1"));
  EXPECT_EQ(doubtful.status(), CalibrationStatus::refused);  // 0.935 g is not the Earth's
  experiment.field.magnitude = 1.0;
  EXPECT_TRUE(calibrate(experiment, observations).findings.warnings.empty());
}

// The default method is joint, with and without a missing opposite reading.
TEST(Calibrate, IsJointByDefault) {
  const SensorModel truth = accelerometer_truth();
  Observations observations = observe(truth, {.noise_sd = 1e-4});
  Experiment experiment = experiment_for(truth);
  experiment.field.in_table.reset();
  EXPECT_EQ(calibrate(experiment, observations).fit.method, Method::joint);
  observations.readings.pop_back();
  observations.response.conservativeResize(11, Eigen::NoChange);
  EXPECT_EQ(calibrate(experiment, observations).fit.method, Method::joint);
}

TEST(Calibrate, UsesAMeasuredCube) {
  std::array<Eigen::Vector3d, 6> normals;
  for (const Face face : all_faces) {
    const Eigen::Vector3d axis(1.0, static_cast<double>(face), -2.0);
    normals[static_cast<std::size_t>(face)] =
        Eigen::AngleAxisd(3e-3, axis.normalized()) * nominal_normal(face);
  }
  const SensorModel truth = accelerometer_truth();
  SimulationOptions options{.slope = {0.005, -0.003}, .positioner = Positioner(normals, "c7")};
  const Observations observations =
      simulate(truth, make_run_sheet(standard_design(12), 1, 1), options);
  Experiment experiment = experiment_for(truth);
  for (const Method method : {Method::paired, Method::joint}) {
    experiment.fit.method = method;
    experiment.positioner = Positioner();
    const double nominal = (calibrate(experiment, observations).sensor.response.sensitivity -
                            truth.response.sensitivity)
                               .norm();
    experiment.positioner = options.positioner;
    const Calibration result = calibrate(experiment, observations);
    EXPECT_GT(nominal, 1e-3);
    EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-11);
    EXPECT_EQ(result.provenance.positioner, "c7");
  }
}

// ---- refusals ----

std::vector<std::string> undetermined(const Experiment& experiment,
                                      const Observations& observations,
                                      std::string& message) {
  try {
    static_cast<void>(calibrate(experiment, observations));
  } catch (const RankDeficientError& error) {
    message = error.what();
    return error.undetermined();
  }
  message = "accepted";
  return {};
}

Observations at_points(const SensorModel& truth, const std::vector<DesignPoint>& points) {
  std::vector<DesignEntry> design;
  for (const DesignPoint& point : points) {
    design.push_back({.point = point});
  }
  return simulate(truth, make_run_sheet(design, 1, 1));
}

TEST(Calibrate, NamesWhatTooFewFacesLeaveOpen) {
  const SensorModel truth = accelerometer_truth();
  std::vector<DesignPoint> points;
  for (const Face rest : {Face::plus_x, Face::minus_x, Face::plus_y, Face::minus_y}) {
    points.emplace_back(rest, face_of((axis_of(rest) + 1) % 3, true));
    points.emplace_back(rest, face_of((axis_of(rest) + 1) % 3, false));
  }
  const Observations observations = at_points(truth, points);
  for (const Method method : {Method::paired, Method::joint, Method::known}) {
    Experiment experiment = experiment_for(truth);
    experiment.fit.method = method;
    std::string message;
    EXPECT_THAT(undetermined(experiment, observations, message),
                testing::ElementsAre("x.sensitivity.z", "y.sensitivity.z", "z.sensitivity.z"));
    EXPECT_THAT(message, HasSubstr("add readings at rest +Z"));
  }
}

TEST(Calibrate, NamesWhatOneOrientationLeavesOpen) {
  const SensorModel truth = accelerometer_truth();
  const DesignPoint point(Face::minus_z, Face::plus_y);
  const Observations observations = at_points(truth, {point, point, point, point, point});
  std::string message;
  EXPECT_THAT(undetermined(experiment_for(truth), observations, message),
              testing::IsSupersetOf({"x.bias", "x.sensitivity.x", "z.sensitivity.y"}));
  EXPECT_THAT(message, HasSubstr("add readings at "));
}

TEST(Calibrate, RefusesFivePointsOnALevelTable) {
  const SensorModel truth = accelerometer_truth();
  std::vector<DesignPoint> points;
  for (const DesignEntry& entry : standard_design(6)) {
    points.push_back(entry.point);
  }
  points.pop_back();
  std::string message;
  EXPECT_THAT(undetermined(experiment_for(truth), at_points(truth, points), message),
              testing::Not(testing::IsEmpty()));
  EXPECT_THAT(message, HasSubstr("add readings at rest"));
  EXPECT_THAT(message, HasSubstr("use the method 'known'"));
}

TEST(Calibrate, RefusesSixNoisyPointsOnANearlyLevelTable) {
  const SensorModel truth = accelerometer_truth();
  const Calibration result =
      calibrate(experiment_for(truth),
                observe(truth, {.points = 6, .slope = {1e-4, -1e-4}, .noise_sd = 1e-3, .seed = 3}));
  EXPECT_EQ(result.findings.status, CalibrationStatus::refused);
  EXPECT_EQ(codes(result).at(0), "uncertain_direction");
}

TEST(Calibrate, ChecksItsArguments) {
  const SensorModel truth = accelerometer_truth();
  const Observations good = observe(truth, {});
  Experiment experiment = experiment_for(truth);
  experiment.instrument.kind = "";
  EXPECT_THROW(static_cast<void>(calibrate(experiment, good)), SetupError);
  experiment = experiment_for(truth);
  experiment.instrument.axes = {"x", "x", "z"};
  EXPECT_THROW(static_cast<void>(calibrate(experiment, good)), SetupError);
  experiment.instrument.axes = {"x", "y"};
  EXPECT_THROW(static_cast<void>(calibrate(experiment, good)), DomainError);
  experiment = experiment_for(truth);
  experiment.fit.weighting = Weighting::samples;
  EXPECT_THROW(static_cast<void>(calibrate(experiment, good)), RefusedError);
  experiment.fit.weighting = Weighting::sd;
  EXPECT_THROW(static_cast<void>(calibrate(experiment, good)), RefusedError);
  experiment = experiment_for(truth);
  Observations bad_samples = good;
  bad_samples.samples = Eigen::VectorXd::Zero(12);
  EXPECT_THROW(static_cast<void>(calibrate(experiment, bad_samples)), DomainError);
  bad_samples.samples = Eigen::VectorXd::Ones(11);
  EXPECT_THROW(static_cast<void>(calibrate(experiment, bad_samples)), DomainError);
  experiment.rotation_sensor_from_positioner *= 2.0;
  EXPECT_THROW(static_cast<void>(calibrate(experiment, good)), DomainError);
  experiment = experiment_for(truth);
  experiment.fit.method = Method::paired;
  EXPECT_THROW(static_cast<void>(calibrate(experiment, observe(truth, {.points = 6}))),
               RefusedError);
  Observations broken = good;
  broken.response(2, 1) = std::nan("");
  EXPECT_THROW(static_cast<void>(calibrate(experiment_for(truth), broken)), DomainError);
}

TEST(Calibrate, RefusesFiveNoisyPointsThatLeaveNothingToCheckBy) {
  const SensorModel truth = accelerometer_truth();
  std::vector<DesignEntry> design;
  for (const DesignPoint& point :
       {DesignPoint{Face::minus_z, Face::plus_x}, DesignPoint{Face::minus_y, Face::plus_z},
        DesignPoint{Face::minus_z, Face::minus_x}, DesignPoint{Face::plus_x, Face::plus_y},
        DesignPoint{Face::minus_x, Face::plus_y}}) {
    design.push_back({.point = point});
  }
  const Observations observations =
      simulate(truth, make_run_sheet(design, 1, 1), {.noise_sd = 1e-4, .slope = {0.003, 0.002}});
  std::string message;
  EXPECT_THAT(undetermined(experiment_for(truth), observations, message), Contains("x.bias"));
  EXPECT_THAT(message, HasSubstr("add readings at rest"));
}

TEST(Calibrate, RefusesAnAxisThatDoesNotRespond) {
  const SensorModel truth = accelerometer_truth();
  Observations observations = observe(truth, {.noise_sd = 1e-4});
  observations.response.col(1).setConstant(0.5);
  for (const Method method : {Method::paired, Method::joint, Method::known}) {
    Experiment experiment = experiment_for(truth);
    experiment.fit.method = method;
    try {
      static_cast<void>(calibrate(experiment, observations));
      FAIL() << "accepted";
    } catch (const RefusedError& error) {
      EXPECT_THAT(error.what(), HasSubstr("axis y does not respond to the field: all its readings "
                                          "are equal to 0.5"));
    }
  }
}

TEST(Calibrate, RefusesPairsOfAFieldInTheTablesPlane) {
  SensorModel truth = accelerometer_truth();
  truth.field = {.kind = "custom", .magnitude = 1.0, .in_table = Eigen::Vector3d(1.0, 0.0, 0.0)};
  Experiment experiment = experiment_for(truth);
  const Observations observations = observe(truth, {});
  EXPECT_EQ(calibrate(experiment, observations).findings.status, CalibrationStatus::ok) << "joint";
  experiment.fit.method = Method::paired;
  EXPECT_THROW(static_cast<void>(calibrate(experiment, observations)), RefusedError);
  // Method paired also fails if the field is stated along the normal and is not there.
  experiment.field.in_table = Eigen::Vector3d(0.0, 0.0, 1.0);
  EXPECT_THROW(static_cast<void>(calibrate(experiment, observations)), Error);
}

TEST(Calibrate, RefusesAMagnitudeThatContradictsTheVector) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::known;
  experiment.field.in_table = Eigen::Vector3d(0.0, 0.0, 2.0);
  experiment.field.magnitude = 1.0;
  EXPECT_THROW(static_cast<void>(calibrate(experiment, observe(truth, {}))), SetupError);
  experiment.field.magnitude.reset();
  experiment.table.slope = {0.01, 0.0};
  EXPECT_THROW(static_cast<void>(calibrate(experiment, observe(truth, {}))), SetupError);
}

// With fewer than three axes all half differences are fitted together (method.md, section 5). The
// cross-axis terms of the axis contribute to the slope too.
TEST(Calibrate, FitsTheSlopeOfOneAxisFromAllDifferences) {
  LinearResponse response{.bias = Eigen::VectorXd::Constant(1, 0.1),
                          .sensitivity = SensitivityMatrix::Zero(1, 3)};
  response.sensitivity << 2.5, 0.05, -0.04;
  const SensorModel truth = test::truth_of(response, "inclinometer");
  double squares = 0.0;
  constexpr int runs = 100;
  for (int i = 0; i < runs; ++i) {
    const Calibration result = calibrate(
        experiment_for(truth), observe(truth, {.points = 24,
                                               .slope = {0.004, -0.003},
                                               .noise_sd = 1e-4,
                                               .seed = static_cast<std::uint64_t>(i) + 1}));
    squares += std::pow(
        (result.fit.levelness->mean_x - 0.004) / result.fit.levelness->standard_error_x, 2);
  }
  // The mean of t^2 with 10 degrees of freedom is 10 / 8 = 1.25.
  EXPECT_NEAR(squares / runs, 1.25, 0.7);
}

TEST(Calibrate, StatesTheStandardErrorOfTheMeanSlopeWithUnequalRepeats) {
  const SensorModel truth = accelerometer_truth();
  std::vector<DesignEntry> design = standard_design(12);
  for (int repeat = 0; repeat < 8; ++repeat) {
    design.push_back(design[0]);
    design.push_back(design[1]);
  }
  double squares = 0.0;
  constexpr int runs = 300;
  for (int i = 0; i < runs; ++i) {
    const Observations observations =
        simulate(truth, make_run_sheet(design, 1, 1),
                 {.noise_sd = 1e-4, .seed = static_cast<std::uint64_t>(i) + 1});
    Experiment experiment = experiment_for(truth);
    experiment.fit.method = Method::paired;
    const Levelness levelness = *calibrate(experiment, observations).fit.levelness;
    squares += std::pow(levelness.mean_x / levelness.standard_error_x, 2) +
               std::pow(levelness.mean_y / levelness.standard_error_y, 2);
  }
  // The mean of t^2 with 16 degrees of freedom is 16 / 14 = 1.14. The standard deviation of a mean
  // of 600 squares is 6 %.
  EXPECT_NEAR(squares / (2 * runs), 1.14, 0.3);
}

// ---- warnings ----

TEST(Calibrate, WarnsOfAReversedAxisAndOfExchangedOnes) {
  SensorModel truth = accelerometer_truth();
  truth.response.sensitivity.row(1) *= -1.0;
  const Calibration reversed = calibrate(experiment_for(truth), observe(truth, {}));
  ASSERT_EQ(codes(reversed), std::vector<std::string_view>{"axis_reversed"});
  EXPECT_THAT(reversed.findings.warnings[0].message, HasSubstr("axis y is reversed"));
  truth = accelerometer_truth();
  truth.response.sensitivity.row(0).swap(truth.response.sensitivity.row(2));
  const Calibration swapped = calibrate(experiment_for(truth), observe(truth, {}));
  EXPECT_EQ(codes(swapped), (std::vector<std::string_view>{"axis_swapped", "axis_swapped"}));
  EXPECT_THAT(swapped.findings.warnings[0].message, HasSubstr("axis x is most sensitive along +z"));
}

TEST(Calibrate, NamesTheFaceThatDisagreesAboutTheSlope) {
  const SensorModel truth = accelerometer_truth();
  Observations observations =
      observe(truth, {.slope = {0.003, 0.001}, .noise_sd = 1e-4, .seed = 6});
  // Dirt under a foot tilts the cube by 8 mrad at one seat on face -Y.
  const int run = run_at(observations, {Face::minus_y, Face::plus_z});
  observations.response.row(run - 1) += Eigen::RowVector3d(0.02, 0.0, 0.0);
  for (const Method method : {Method::paired, Method::joint, Method::known}) {
    Experiment experiment = experiment_for(truth);
    experiment.fit.method = method;
    if (method == Method::known) {
      experiment.table.slope = {0.003, 0.001};
    }
    const Calibration result = calibrate(experiment, observations);
    ASSERT_TRUE(result.fit.levelness->suspect);
    EXPECT_EQ(result.fit.levelness->suspect->point.rest(), Face::minus_y);
    EXPECT_FALSE(result.fit.levelness->consistent);
    EXPECT_LT(result.fit.levelness->p_value, 0.005);
    // The search for mistakes names the reading of the two that is wrong.
    EXPECT_THAT(codes(result), Contains(testing::AnyOf("tilted_seat", "outlier")));
    EXPECT_EQ(result.findings.warnings[0].runs, std::vector<int>{run});
    EXPECT_EQ(result.findings.status, CalibrationStatus::warning);
  }
}

TEST(Calibrate, NamesAnOutlier) {
  const SensorModel truth = accelerometer_truth();
  Observations observations = observe(truth, {.replicates = 2, .noise_sd = 1e-4, .seed = 7});
  observations.response(10, 2) += 5e-3;
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::joint;
  const Calibration result = calibrate(experiment, observations);
  const auto outlier = std::find_if(
      result.findings.warnings.begin(), result.findings.warnings.end(),
      [](const CalibrationWarning& warning) { return warning.code == WarningCode::outlier; });
  ASSERT_NE(outlier, result.findings.warnings.end());
  EXPECT_EQ(outlier->runs, std::vector<int>{11});
  EXPECT_THAT(outlier->message, HasSubstr("run 11 fits"));
  EXPECT_THAT(outlier->message, HasSubstr("axis z"));
}

TEST(Calibrate, WarnsOfATableThatMovedBetweenBlocks) {
  const SensorModel truth = accelerometer_truth();
  const Observations moved =
      concatenate({observe(truth, {.slope = {-0.001, 0.002}, .noise_sd = 1e-4, .seed = 1}),
                   observe(truth, {.slope = {0.001, 0.0}, .noise_sd = 1e-4, .seed = 2})});
  for (const Method method : {Method::paired, Method::joint}) {
    Experiment experiment = experiment_for(truth);
    experiment.fit.method = method;
    EXPECT_THAT(codes(calibrate(experiment, moved)), Contains("table_moved"));
  }
}

TEST(Calibrate, NamesTheReadingsOfOppositeFacesThatWereExchanged) {
  const SensorModel truth = accelerometer_truth();
  Observations observations = observe(truth, {.slope = {0.003, -0.002}, .noise_sd = 1e-4});
  const int down = run_at(observations, {Face::minus_z, Face::minus_x});
  const int up = run_at(observations, {Face::plus_z, Face::minus_x});
  observations.response.row(down - 1).swap(observations.response.row(up - 1));
  const Calibration result = calibrate(experiment_for(truth), observations);
  ASSERT_EQ(codes(result).at(0), "exchanged");
  EXPECT_THAT(result.findings.warnings[0].runs, testing::UnorderedElementsAre(down, up));
  EXPECT_EQ(result.findings.status, CalibrationStatus::refused);
}

TEST(Calibrate, WarnsOfFieldsInAnotherUnit) {
  const SensorModel truth = accelerometer_truth();
  Observations observations = observe(truth, {.noise_sd = 1e-4});
  const Positioner cube;
  for (Reading& reading : observations.readings) {
    reading.field_in_sensor =
        9.81 * (cube.rotation_table_from_positioner(*reading.point).transpose() *
                Eigen::Vector3d::UnitZ());
  }
  EXPECT_THAT(codes(calibrate(experiment_for(truth), observations)), Contains("field_magnitude"));
}

TEST(Calibrate, RefusesNumbersThatAreNoReadings) {
  const SensorModel truth = accelerometer_truth();
  Observations observations = observe(truth, {});
  observations.response(3, 0) = 1e300;
  EXPECT_THROW(static_cast<void>(calibrate(experiment_for(truth), observations)), RefusedError);
}

TEST(Calibrate, WarnsOfASlopeThatIsNotTheStatedOne) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::known;
  const Observations observations =
      observe(truth, {.slope = {0.004, 0.0}, .noise_sd = 1e-4, .seed = 7});
  EXPECT_THAT(codes(calibrate(experiment, observations)), Contains("slope"));
  experiment.table.slope = {0.004, 0.0};
  EXPECT_EQ(calibrate(experiment, observations).findings.status, CalibrationStatus::ok);
}

TEST(Calibrate, WarnsWhereNothingIsLeftToCheck) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::known;
  const Observations observations = at_points(truth, {{Face::plus_x, Face::plus_y},
                                                      {Face::minus_x, Face::plus_y},
                                                      {Face::plus_y, Face::plus_z},
                                                      {Face::minus_z, Face::plus_x}});
  const Calibration result = calibrate(experiment, observations);
  EXPECT_THAT(codes(result), Contains("no_redundancy"));
  EXPECT_TRUE(std::isnan(result.fit.statistics->residual_sd(0)));
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-13);
}

TEST(Calibrate, WarnsOfExchangedLabels) {
  const SensorModel truth = accelerometer_truth();
  Observations observations = observe(truth, {.noise_sd = 1e-4});
  std::swap(observations.readings[2].point, observations.readings[3].point);
  ASSERT_NE(observations.readings[2].point->rest(), observations.readings[3].point->rest());
  for (const Method method : {Method::paired, Method::joint, Method::known}) {
    Experiment experiment = experiment_for(truth);
    experiment.fit.method = method;
    const Calibration result = calibrate(experiment, observations);
    EXPECT_EQ(codes(result).at(0), "exchanged");
    EXPECT_EQ(result.findings.warnings[0].runs, (std::vector<int>{3, 4}));
  }
}

// The levelness test gives a false alarm in 0.5 % of good runs (method.md, section 5).
TEST(Calibrate, GoodRunsHaveNoWarning) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  int warned = 0;
  constexpr int runs = 600;
  for (int i = 0; i < runs; ++i) {
    experiment.fit.method = i % 2 == 0 ? Method::paired : Method::joint;
    const Calibration result =
        calibrate(experiment, observe(truth, {.replicates = 1 + i % 3,
                                              .slope = {0.005, -0.002},
                                              .noise_sd = 1e-4,
                                              .seed = static_cast<std::uint64_t>(1000 + i)}));
    warned += result.findings.status == CalibrationStatus::ok ? 0 : 1;
  }
  // Expected: 0.5 % by the levelness test and 0.1 % by each of two other tests, 4.2 runs. The limit
  // is 5 standard deviations above.
  EXPECT_LE(warned, 14);
}

// A knock changes the biases of two or of all axes between two readings. It is named with its
// place, and the biases are those in the middle of the run.
TEST(AStepOfTheBias, IsFoundIfItConcernsSeveralAxes) {
  const SensorModel truth = test::accelerometer_truth();
  const Experiment experiment = test::experiment_for(truth);
  constexpr double noise = 1e-4;
  constexpr int runs = 20;
  for (const int axes : {2, 3}) {
    int named = 0;
    int covered = 0;  // out of 3 * runs
    for (std::uint64_t seed = 1; seed <= runs; ++seed) {
      Observations run = simulate(truth, make_run_sheet(standard_design(12), 1, seed),
                                  {.noise_sd = noise, .seed = seed});
      Eigen::Vector3d step(10.0 * noise, -10.0 * noise, axes == 3 ? 10.0 * noise : 0.0);
      run.response.bottomRows(7).rowwise() += step.transpose();
      const Calibration found = calibrate(experiment, run);
      for (const CalibrationWarning& warning : found.findings.warnings) {
        named +=
            warning.code == WarningCode::bias_step && warning.runs == std::vector{5, 6} ? 1 : 0;
      }
      for (Eigen::Index k = 0; k < 3; ++k) {
        const double expected = truth.response.bias(k) + step(k) * 7.0 / 12.0;
        covered += std::abs(found.sensor.response.bias(k) - expected) <=
                   found.fit.statistics->interval_95(4 * k);
      }
    }
    EXPECT_GE(named, 18) << axes;
    EXPECT_GE(covered, 53) << axes;
  }
}

// The bias of axis x steps by 20 sigma after the sixth reading. The step is a term of the fit.
// If the first six readings are those on the negative faces, the step equals a sum of the field's
// components, and the readings hardly determine it. As a term it would spoil all coefficients.
TEST(AStepOfTheBias, IsFittedOnlyIfTheReadingsDetermineIt) {
  const SensorModel truth = test::accelerometer_truth();
  const Experiment experiment = test::experiment_for(truth);
  constexpr double noise = 1e-4;
  for (const bool in_order_of_faces : {false, true}) {
    int told = 0;
    constexpr int runs = 10;
    for (std::uint64_t seed = 1; seed <= runs; ++seed) {
      Observations run = simulate(truth, make_run_sheet(standard_design(12), 1, seed),
                                  {.noise_sd = noise, .slope = {2e-3, -3e-3}, .seed = seed});
      std::vector<std::size_t> rows(12);
      std::iota(rows.begin(), rows.end(), std::size_t{0});
      std::stable_partition(rows.begin(), rows.end(), [&](std::size_t i) {
        return !in_order_of_faces || face_name(run.readings[i].point->rest()).front() == '-';
      });
      run = select_rows(run, rows);
      for (std::size_t i = 0; i < rows.size(); ++i) {
        run.readings[i].run = static_cast<int>(i) + 1;
      }
      run.response.col(0).tail(6).array() += 20.0 * noise;
      const Calibration found = calibrate(experiment, run);
      told += std::any_of(
          found.findings.warnings.begin(), found.findings.warnings.end(),
          [](const CalibrationWarning& one) { return one.code == WarningCode::bias_step; });
      EXPECT_LE(found.fit.statistics->condition_number, 30.0);
    }
    if (in_order_of_faces) {
      EXPECT_EQ(told, 0);
    } else {
      EXPECT_GE(told, 8);
    }
  }
}

}  // namespace
}  // namespace axiscal
