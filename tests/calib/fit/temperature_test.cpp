// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/temperature.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/random.hpp"
#include "data.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

SensorModel warm_truth() {
  SensorModel truth = accelerometer_truth();
  TemperatureResponse& terms = truth.temperature.emplace();
  terms.spans = {{.reference = 20.0, .low = -20.0, .high = 60.0}};
  terms.bias.resize(3, 2);
  terms.scale.resize(3, 2);
  // clang-format off
  terms.bias << 1e-4,  1e-6,
               -2e-4,  2e-6,
                3e-4, -1e-6;
  terms.scale << 2e-4,  1e-6,
                -1e-4,  3e-6,
                 1.5e-4, -2e-6;
  // clang-format on
  return truth;
}

Observations observe_at(const SensorModel& truth,
                        const std::vector<double>& temperatures,
                        double noise_sd = 0.0,
                        double temperature_sd = 0.0,
                        std::uint64_t seed = 1) {
  SimulationOptions options;
  options.noise_sd = noise_sd;
  options.temperature_sd = temperature_sd;
  options.slope = {0.003, -0.004};
  options.seed = seed;
  return simulate(truth, make_run_sheet(standard_design(12), 1, seed, temperatures), options);
}

Experiment warm_experiment(const SensorModel& truth, Method method, int order) {
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = method;
  experiment.fit.temperature.order = order;
  experiment.fit.temperature.reference = 20.0;
  if (method == Method::known) {
    experiment.table.slope = {0.003, -0.004};
  }
  return experiment;
}

class ByMethod : public testing::TestWithParam<Method> {};

TEST_P(ByMethod, ReturnsTheTruthWithoutNoise) {
  const SensorModel truth = warm_truth();
  const Observations observations = observe_at(truth, {-10.0, 25.0, 55.0}, 0.0, 0.05);
  const Calibration result = calibrate(warm_experiment(truth, GetParam(), 2), observations);
  ASSERT_TRUE(result.sensor.temperature);
  EXPECT_MATRIX_NEAR(result.sensor.response.bias, truth.response.bias, 1e-12);
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-11);
  EXPECT_MATRIX_NEAR(result.sensor.temperature->bias, truth.temperature->bias, 1e-12);
  EXPECT_MATRIX_NEAR(result.sensor.temperature->scale, truth.temperature->scale, 1e-12);
  EXPECT_NEAR(result.fit.levelness->mean_x, 0.003, 1e-11);
  EXPECT_NEAR(result.fit.levelness->mean_y, -0.004, 1e-11);
  EXPECT_EQ(result.fit.statistics->parameter_names[4], "x.bias.d");
  EXPECT_EQ(result.fit.statistics->parameter_names[7], "x.scale.d2");
}

INSTANTIATE_TEST_SUITE_P(Temperature,
                         ByMethod,
                         testing::Values(Method::paired, Method::joint, Method::known),
                         [](const auto& one) { return std::string(method_name(one.param)); });

TEST(Temperature, StandardErrorsAreTheScatter) {
  const SensorModel truth = warm_truth();
  constexpr int runs = 200;
  for (const Method method : {Method::paired, Method::joint}) {
    Eigen::VectorXd squares = Eigen::VectorXd::Zero(6);
    for (int seed = 1; seed <= runs; ++seed) {
      const Calibration result = calibrate(
          warm_experiment(truth, method, 2),
          observe_at(truth, {-10.0, 25.0, 55.0}, 1e-4, 0.05, static_cast<unsigned>(seed)));
      const TemperatureResponse& terms = *result.sensor.temperature;
      const auto add = [&](Eigen::Index i, double error, double u) {
        squares(i) += error * error / (u * u) / runs;
      };
      add(0, result.sensor.response.bias(1) - truth.response.bias(1),
          result.fit.statistics->bias_se(1));
      add(1, result.sensor.response.sensitivity(2, 2) - truth.response.sensitivity(2, 2),
          result.fit.statistics->sensitivity_se(2, 2));
      add(2, terms.bias(0, 0) - 1e-4, terms.bias_se(0, 0));
      add(3, terms.bias(1, 1) - 2e-6, terms.bias_se(1, 1));
      add(4, terms.scale(0, 0) - 2e-4, terms.scale_se(0, 0));
      add(5, terms.scale(2, 1) + 2e-6, terms.scale_se(2, 1));
    }
    // The mean of t^2 is 1.25 with 10 degrees of freedom and 1.08 with 27.
    for (const double mean : squares) {
      EXPECT_NEAR(mean, method == Method::paired ? 1.25 : 1.08, 0.4);
    }
  }
}

TEST(Temperature, ChoosesTheOrderThatIsThere) {
  const SensorModel quadratic = warm_truth();
  SensorModel linear = quadratic;
  linear.temperature->bias.col(1).setZero();
  linear.temperature->scale.col(1).setZero();
  SensorModel none = linear;
  none.temperature->bias.setZero();
  none.temperature->scale.setZero();
  int right = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const std::vector<std::pair<const SensorModel*, Eigen::Index>> cases = {
        {&quadratic, 2}, {&linear, 1}, {&none, 0}};
    for (const auto& [truth, order] : cases) {
      Experiment experiment = warm_experiment(*truth, Method::joint, 0);
      experiment.fit.temperature.automatic = true;
      const Calibration result =
          calibrate(experiment, observe_at(*truth, {-10.0, 10.0, 30.0, 55.0}, 1e-4, 0.0, seed));
      right +=
          (result.sensor.temperature ? result.sensor.temperature->bias.cols() : 0) == order ? 1 : 0;
    }
  }
  EXPECT_GE(right, 26);  // AICc takes too high an order in 10 %
  // Two temperatures determine at most a linear term.
  Experiment experiment = warm_experiment(quadratic, Method::joint, 0);
  experiment.fit.temperature.automatic = true;
  const Calibration result = calibrate(experiment, observe_at(quadratic, {0.0, 40.0}, 1e-4));
  EXPECT_EQ(result.sensor.temperature->bias.cols(), 1);
  EXPECT_EQ(result.sensor.temperature->trials.size(), 2U);
}

// A cubic truth is fitted by a quadratic polynomial, without repeats. The test reports it, and the
// scatter of the soaks about the curve is counted.
TEST(Soaks, TellThatThePolynomialDoesNotFit) {
  SensorModel truth = warm_truth();
  TemperatureResponse& terms = *truth.temperature;
  terms.bias.conservativeResize(3, 3);
  terms.scale.conservativeResize(3, 3);
  terms.bias.col(2).setConstant(4e-8);
  terms.scale.col(2).setZero();
  const std::vector<double> levels = {-20.0, -5.0, 10.0, 25.0, 40.0, 60.0};
  const Experiment experiment = warm_experiment(truth, Method::joint, 2);
  int told = 0;
  int held = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Calibration found = calibrate(experiment, observe_at(truth, levels, 1e-4, 0.0, seed));
    told += std::any_of(
                found.findings.warnings.begin(), found.findings.warnings.end(),
                [](const CalibrationWarning& one) { return one.code == WarningCode::lack_of_fit; })
                ? 1
                : 0;
    EXPECT_EQ(found.fit.statistics->components.front().name, "soaks");
    EXPECT_NEAR(found.fit.statistics->residual_sd(0), 1e-4, 4e-5);
    for (Eigen::Index k = 0; k < 3; ++k) {
      held += std::abs(found.sensor.response.bias(k) - truth.response.bias(k)) <=
                      found.fit.statistics->interval_95(8 * k)
                  ? 1
                  : 0;
    }
    const std::string text = calibration_json(found);
    EXPECT_EQ(calibration_json(parse_calibration(text, "again.json")), text);
  }
  EXPECT_GE(told, 19);
  EXPECT_GE(held, 54);  // out of 60
}

TEST(Soaks, ThatLieOnTheCurveChangeNothing) {
  const SensorModel truth = warm_truth();
  const std::vector<double> levels = {-20.0, -5.0, 10.0, 25.0, 40.0, 60.0};
  int alarms = 0;
  int held = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Calibration found = calibrate(warm_experiment(truth, Method::joint, 2),
                                        observe_at(truth, levels, 1e-4, 0.0, seed));
    alarms += found.findings.warnings.empty() ? 0 : 1;
    for (Eigen::Index k = 0; k < 3; ++k) {
      held += std::abs(found.sensor.response.bias(k) - truth.response.bias(k)) <=
                      found.fit.statistics->interval_95(8 * k)
                  ? 1
                  : 0;
    }
  }
  EXPECT_LE(alarms, 3);
  EXPECT_GE(held, 160);  // out of 180
}

TEST(Temperature, RefusesWhatTheLevelsDoNotDetermine) {
  const SensorModel truth = warm_truth();
  // Small variations of a held temperature do not make a third level.
  const Observations observations = observe_at(truth, {0.0, 40.0}, 1e-4, 0.05);
  for (const Method method : {Method::paired, Method::joint, Method::known}) {
    try {
      static_cast<void>(calibrate(warm_experiment(truth, method, 2), observations));
      FAIL();
    } catch (const RankDeficientError& error) {
      EXPECT_THAT(error.what(), HasSubstr("x.bias.d2"));
      EXPECT_THAT(error.what(), HasSubstr("or use temperature order 1"));
      EXPECT_THAT(error.settings(), testing::ElementsAre(settings::temperature_order));
    }
  }
  Observations without = observe_at(truth, {});
  EXPECT_THROW(static_cast<void>(calibrate(warm_experiment(truth, Method::joint, 1), without)),
               RefusedError);
}

TEST(Temperature, ContinuousTemperaturesGoByJoint) {
  const SensorModel truth = warm_truth();
  std::vector<RunSheetRow> sheet = make_run_sheet(standard_design(12), 4, 3);
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    sheet[i].temperature = -10.0 + 1.3 * static_cast<double>(i);
  }
  SimulationOptions options;
  options.slope = {0.002, 0.001};
  const Observations observations = simulate(truth, sheet, options);
  Experiment experiment = warm_experiment(truth, Method::joint, 2);
  experiment.fit.method.reset();
  EXPECT_EQ(choose_method(experiment, observations), Method::joint);
  const Calibration result = calibrate(experiment, observations);
  EXPECT_MATRIX_NEAR(result.sensor.temperature->scale, truth.temperature->scale, 1e-11);
}

TEST(Temperature, ReductionGoesBackAndFlagsWhatIsOutside) {
  const SensorModel truth = warm_truth();
  const Reducer reducer(truth);
  EXPECT_TRUE(reducer.needs_temperature());
  const Eigen::Vector3d field(0.6, -0.64, 0.48);
  for (const double t : {-15.0, 20.0, 70.0}) {
    const Eigen::VectorXd v = response_at(truth, field, t);
    const ReducedReading reduced = reducer.reduce(std::array{v(0), v(1), v(2)}, {.temperature = t});
    EXPECT_MATRIX_NEAR(reduced.field_in_sensor, field, 1e-14);
    EXPECT_EQ(reduced.extrapolated, t > 60.0);
  }
}

// With more than three axes the weights depend on the scales: weighted least squares at each
// temperature.
TEST(Temperature, ReductionOfFourAxesWeighsThemByTheirScale) {
  SensorModel truth = warm_truth();
  truth.instrument.axes = {"a", "b", "c", "d"};
  truth.response.bias = Eigen::Vector4d(0.1, 0.2, 0.3, 0.4);
  SensitivityMatrix S(4, 3);
  S << 1.0, 0.1, 0.0, 0.0, 1.1, 0.1, 0.2, 0.0, 0.9, 0.5, 0.6, 0.7;
  truth.response.sensitivity = S;
  truth.temperature->bias = Eigen::MatrixXd::Constant(4, 1, 1e-3);
  truth.temperature->scale = Eigen::Vector4d(0.01, -0.005, 0.0, 0.02);
  Calibration record;
  record.sensor = truth;
  FitStatistics& statistics = record.fit.statistics.emplace();
  statistics.residual_sd = Eigen::Vector4d(1.0, 2.0, 1.5, 0.5);
  const double t = 40.0;
  const Eigen::Vector4d errors(0.01, -0.02, 0.015, 0.01);
  const Eigen::VectorXd v = response_at(truth, {0.3, 0.5, 0.8}, t) + errors;
  const ReducedReading reduced =
      Reducer(record).reduce(std::array{v(0), v(1), v(2), v(3)}, {.temperature = t});
  // Compares with the normal equations of v - b(t) = scale S f.
  Eigen::Vector4d scale;
  Eigen::Vector4d above;
  for (int k = 0; k < 4; ++k) {
    scale(k) = truth.temperature->scale_at(k, t);
    above(k) = v(k) - truth.response.bias(k) - truth.temperature->bias_shift(k, t);
  }
  const Eigen::MatrixXd A = scale.asDiagonal() * Eigen::MatrixXd(S);
  const Eigen::MatrixXd W = statistics.residual_sd.cwiseAbs2().cwiseInverse().asDiagonal();
  const Eigen::Vector3d expected = (A.transpose() * W * A).inverse() * A.transpose() * W * above;
  EXPECT_MATRIX_NEAR(reduced.field_in_sensor, expected, 1e-13);
}

TEST(Temperature, RecordsKeepTheTerms) {
  const SensorModel truth = warm_truth();
  Experiment experiment = warm_experiment(truth, Method::joint, 0);
  experiment.fit.temperature.automatic = true;
  const Calibration result =
      calibrate(experiment, observe_at(truth, {-10.0, 25.0, 55.0}, 1e-4, 0.05));
  const std::string text = calibration_json(result);
  EXPECT_EQ(calibration_json(parse_calibration(text, "t.json")), text);
}

TEST(SoakLevels, TellsHeldTemperaturesFromContinuousOnes) {
  EXPECT_EQ(soak_levels({20.0, 20.0, 20.0}), (std::vector<int>{0, 0, 0}));
  EXPECT_EQ(soak_levels({25.1, -10.0, 25.0, -10.2, 55.0, 55.3}),
            (std::vector<int>{1, 0, 1, 0, 2, 2}));
  std::vector<double> rising;
  for (int i = 0; i < 40; ++i) {
    rising.push_back(20.0 + 0.5 * i);
  }
  EXPECT_TRUE(soak_levels(rising).empty());
  RandomStream random(3);
  std::vector<double> scattered;
  for (int i = 0; i < 60; ++i) {
    scattered.push_back(60.0 * random.uniform());
  }
  EXPECT_TRUE(soak_levels(scattered).empty());
}

TEST(SoakState, SaysWhenTheTemperatureIsSteady) {
  std::vector<double> times;
  std::vector<double> values;
  RandomStream random(5);
  constexpr double tau = 600.0;
  for (double t = 0.0; t < 4000.0; t += 10.0) {
    times.push_back(t);
    values.push_back(60.0 - 40.0 * std::exp(-t / tau) + 0.01 * random.normal());
  }
  const auto at = [&](std::size_t count) {
    return soak_state(std::span(times).first(count), std::span(values).first(count), 300.0, 0.2);
  };
  const SoakState early = at(100);  // 1000 s
  EXPECT_FALSE(early.steady);
  EXPECT_NEAR(early.rate, 40.0 / tau * std::exp(-850.0 / tau), 0.002);
  // The rate times 300 s, 40 / tau exp(-t / tau) 300, falls to 0.2 at t = 2450 s (middle of the
  // window).
  EXPECT_NEAR(early.remaining_s, 1600.0, 400.0);
  EXPECT_FALSE(at(200).steady);
  EXPECT_TRUE(at(400).steady);
  EXPECT_TRUE(std::isnan(at(2).rate));
  EXPECT_THROW(static_cast<void>(soak_state(times, std::span(values).first(3), 1.0, 1.0)),
               DomainError);
}

// ---- method bias ----

TEST(BiasMethod, TakesTheSensitivityFromARecordAndTheFieldOut) {
  const SensorModel truth = warm_truth();
  std::vector<RunSheetRow> sheet;
  for (int i = 0; i < 60; ++i) {
    sheet.push_back({.run = i + 1, .entry = {.point = {Face::minus_z, Face::plus_x}}});
    sheet.back().temperature = -15.0 + i;
  }
  SensorModel flat = truth;
  flat.temperature->scale.setZero();
  const Observations observations = simulate(flat, sheet);
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::bias;
  experiment.fit.temperature.order = 2;
  experiment.fit.temperature.reference = 20.0;
  experiment.from =
      std::make_shared<const Calibration>(Calibration{.sensor = accelerometer_truth()});
  const Calibration result = calibrate(experiment, observations);
  EXPECT_MATRIX_NEAR(result.sensor.response.bias, truth.response.bias, 1e-12);
  EXPECT_MATRIX_NEAR(result.sensor.temperature->bias, truth.temperature->bias, 1e-13);
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 0.0);
  const std::string text = calibration_json(result);
  EXPECT_EQ(calibration_json(parse_calibration(text, "t.json")), text);
  // Without labels the effect of the field is unknown, so the biases at the reference temperature
  // are those of the record.
  Observations unlabelled = observations;
  for (Reading& reading : unlabelled.readings) {
    reading.point.reset();
  }
  const Calibration moved = calibrate(experiment, unlabelled);
  EXPECT_MATRIX_NEAR(moved.sensor.response.bias, truth.response.bias, 1e-15);
  EXPECT_MATRIX_NEAR(moved.sensor.temperature->bias, truth.temperature->bias, 1e-13);
  EXPECT_EQ(moved.findings.status, CalibrationStatus::ok);
  // Without a record the biases include gravity, and a warning reports this.
  experiment.from = nullptr;
  const Calibration with_gravity = calibrate(experiment, observations);
  EXPECT_EQ(with_gravity.findings.status, CalibrationStatus::warning);
  ASSERT_EQ(with_gravity.findings.warnings.size(), 1U);
  EXPECT_EQ(with_gravity.findings.warnings.front().code, WarningCode::field_in_bias);
}

// imu_thermal_tofupilot: numpy.polyfit of degree 3 over all 8400 samples. The numbers are from its
// SOURCE.md.
TEST(BiasMethod, ReproducesAThermalSweepOfARealGyroscope) {
  AXISCAL_NEED_DATA(path, "imu_thermal_tofupilot/gyro_vs_temperature.csv");
  std::string text = read_whole_file(path);
  text.replace(text.find("temperature_degC"), 16, "temperature");
  std::size_t at = 0;
  CsvReader csv(
      [&](char* to, std::size_t size) {
        const std::size_t count = std::min(size, text.size() - at);
        std::copy_n(text.data() + at, count, to);
        at += count;
        return count;
      },
      "gyro.csv");
  Experiment experiment;
  experiment.instrument.kind = "gyroscope";
  experiment.instrument.axes = {"imu.gyro.x", "imu.gyro.y", "imu.gyro.z"};
  experiment.field.of = make_field("earth_rotation");
  experiment.fit.method = Method::bias;
  experiment.fit.temperature.order = 3;
  experiment.fit.temperature.reference = 0.0;
  const axiscal::Run table = read_observations(csv, {.axes = experiment.instrument.axes});
  const Calibration result = calibrate(experiment, table.observations);
  const Eigen::Vector3d constant(-6.90865875e-02, -1.49698945e-02, 1.63495271e-02);
  Eigen::Matrix3d terms;
  terms << -2.90571392e-04, 1.12714468e-05, -6.54781187e-08, 1.62341933e-04, 1.22591275e-05,
      -6.69269682e-08, -4.33973011e-05, 2.06663131e-07, 1.74334004e-08;
  EXPECT_MATRIX_NEAR(result.sensor.response.bias, constant, 1e-10);
  for (Eigen::Index j = 0; j < 3; ++j) {
    EXPECT_MATRIX_NEAR(
        (result.sensor.temperature->bias.col(j).array() / terms.col(j).array()).matrix(),
        Eigen::Vector3d::Ones(), 1e-8);
  }
  const Eigen::Vector3d r2(0.570171, 0.997120, 0.534950);
  EXPECT_MATRIX_NEAR(result.fit.statistics->r_squared, r2, 1e-6);
  // The published sd divides by n, residual_sd by n - 4.
  const Eigen::Vector3d sd(0.00414834, 0.000951596, 0.00139822);
  EXPECT_MATRIX_NEAR(
      (result.fit.statistics->residual_sd.array() / sd.array() / std::sqrt(8400.0 / 8396.0))
          .matrix(),
      Eigen::Vector3d::Ones(), 1e-5);
  EXPECT_TRUE(result.findings.warnings.empty());
  experiment.fit.temperature.automatic = true;
  EXPECT_GE(calibrate(experiment, table.observations).sensor.temperature->bias.cols(), 3);
}

}  // namespace
}  // namespace axiscal::test
