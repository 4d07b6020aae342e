// SPDX-License-Identifier: Apache-2.0
// Biases over temperature, compared with polynomials that are fitted by QR.
#include "calib/fit/bias_fit.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/field/field_setup.hpp"
#include "calib/record/parameter_names.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

constexpr double sweep_noise = 1e-3;

// Rows (b, b1, b2) of three axes, for b + b1 d + b2 d^2 with d = t - 20.
Eigen::Matrix3d sweep_terms() {
  Eigen::Matrix3d terms;
  terms << 0.1, 2e-3, 3e-5, -0.2, -1e-3, 2e-5, 0.3, 4e-3, -1e-5;
  return terms;
}

// A recording of an instrument at rest at different temperatures.
struct RestingSweep {
  Experiment experiment;
  Observations observations;
  FieldDescription field;

  RestingSweep(const std::string& kind,
               const std::string& unit,
               const std::vector<double>& temperatures,
               std::uint64_t seed = 1,
               double noise_sd = sweep_noise) {
    experiment.instrument.kind = kind;
    experiment.instrument.unit = unit;
    experiment.fit.method = Method::bias;
    experiment.fit.temperature.order = 2;
    const bool turns = kind == "gyroscope";
    experiment.field.of = make_field(turns ? "earth_rotation" : "gravity");
    field = {.kind = turns ? "earth_rotation" : "gravity",
             .unit = turns ? "deg/s" : "g",
             .magnitude = turns ? 15.0 / 3600.0 : 1.0};
    RandomStream random(seed);
    observations.response.resize(static_cast<Eigen::Index>(temperatures.size()), 3);
    for (std::size_t i = 0; i < temperatures.size(); ++i) {
      observations.readings.push_back(
          {.run = static_cast<int>(i) + 1, .temperature = temperatures[i]});
      const double d = temperatures[i] - 20.0;
      observations.response.row(static_cast<Eigen::Index>(i)) =
          (sweep_terms() * Eigen::Vector3d(1.0, d, d * d) + noise_sd * random.normals<3>())
              .transpose();
    }
  }

  [[nodiscard]] Calibration fitted() const {
    Calibration record;
    record.sensor.instrument = experiment.instrument;
    record.sensor.field = field;
    fit_bias(experiment, observations,
             ReadingSource(experiment, observations, Weighting::none, false), record);
    return record;
  }

  // Puts all readings into one pose, and adds the effect of the field in that pose.
  void lay_at(const DesignPoint& point, const SensitivityMatrix& S) {
    const Eigen::Vector3d met = met_at(point);
    for (Reading& reading : observations.readings) {
      reading.point = point;
    }
    observations.response.rowwise() += (S * met).transpose();
  }
  [[nodiscard]] static Eigen::Vector3d met_at(const DesignPoint& point) {
    return Positioner().rotation_table_from_positioner(point).transpose().col(2);
  }
};

// Temperatures from -20 to 50 in mixed order, so that consecutive readings differ.
std::vector<double> mixed_temperatures(int n) {
  std::vector<double> all;
  for (int i = 0; i < n; ++i) {
    all.push_back(-20.0 + 70.0 * ((i * 7) % n) / (n - 1));
  }
  return all;
}

Eigen::MatrixXd temperature_powers(const std::vector<double>& temperatures,
                                   double reference,
                                   int order) {
  Eigen::MatrixXd X(static_cast<Eigen::Index>(temperatures.size()), order + 1);
  for (Eigen::Index i = 0; i < X.rows(); ++i) {
    for (int j = 0; j <= order; ++j) {
      X(i, j) = std::pow(temperatures[static_cast<std::size_t>(i)] - reference, j);
    }
  }
  return X;
}

double mean_temperature(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()))
      .mean();
}

TEST(BiasFit, IsThePolynomialOfLeastSquares) {
  const std::vector<double> temperatures = mixed_temperatures(40);
  const RestingSweep sweep("gyroscope", "deg/s", temperatures);
  const Calibration record = sweep.fitted();
  const double reference = mean_temperature(temperatures);
  ASSERT_TRUE(record.sensor.temperature.has_value());
  EXPECT_NEAR(record.sensor.temperature->spans[0].reference, reference, 1e-12);
  const Eigen::MatrixXd X = temperature_powers(temperatures, reference, 2);
  const Eigen::MatrixXd N = (X.transpose() * X).inverse();
  const FitStatistics& statistics = *record.fit.statistics;
  ASSERT_TRUE(statistics.components.empty());
  const Eigen::MatrixXd& C = statistics.covariance;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Vector3d x = X.colPivHouseholderQr().solve(sweep.observations.response.col(k));
    const Eigen::VectorXd left = sweep.observations.response.col(k) - X * x;
    const double variance = left.squaredNorm() / 37.0;
    EXPECT_NEAR(record.sensor.response.bias(k), x(0), 1e-12);
    EXPECT_MATRIX_NEAR(Eigen::Vector2d(record.sensor.temperature->bias.row(k)), x.tail<2>(), 1e-13);
    EXPECT_NEAR(statistics.residual_sd(k), std::sqrt(variance), 1e-12);
    EXPECT_EQ(statistics.degrees_of_freedom(k), 37.0);
    EXPECT_MATRIX_NEAR(Eigen::MatrixXd(C.block<3, 3>(3 * k, 3 * k)), Eigen::MatrixXd(variance * N),
                       1e-12);
    EXPECT_NEAR(record.fit.residuals[7].response(k), left(7), 1e-12);
  }
  EXPECT_EQ(statistics.parameter_names[0], "x.bias");
  EXPECT_EQ(statistics.parameter_names[5], "y.bias.d2");
  EXPECT_THAT(record.findings.notes, test::HasNote(HasSubstr("the Earth's rotation")));
  EXPECT_EQ(record.sensor.temperature->scale.norm(), 0.0);
}

// The fitted polynomial does not depend on the reference temperature.
TEST(BiasFit, MovesWithItsReference) {
  RestingSweep sweep("gyroscope", "deg/s", mixed_temperatures(40));
  sweep.experiment.fit.temperature.reference = 20.0;
  const Calibration at_20 = sweep.fitted();
  sweep.experiment.fit.temperature.reference = 35.0;
  const Calibration at_35 = sweep.fitted();
  const TemperatureResponse& terms = *at_20.sensor.temperature;
  for (Eigen::Index k = 0; k < 3; ++k) {
    EXPECT_NEAR(at_35.sensor.response.bias(k),
                at_20.sensor.response.bias(k) + 15.0 * terms.bias(k, 0) + 225.0 * terms.bias(k, 1),
                1e-11);
    EXPECT_NEAR(at_35.sensor.temperature->bias(k, 0), terms.bias(k, 0) + 30.0 * terms.bias(k, 1),
                1e-12);
  }
}

TEST(BiasFit, FollowsTheUnitsOfReadingsAndTemperatures) {
  const RestingSweep sweep("gyroscope", "deg/s", mixed_temperatures(40));
  RestingSweep other = sweep;
  other.observations.response *= 1000.0;
  for (Reading& reading : other.observations.readings) {
    reading.temperature = 32.0 + 1.8 * reading.temperature->mean();
  }
  const Calibration a = sweep.fitted();
  const Calibration b = other.fitted();
  EXPECT_MATRIX_NEAR(b.sensor.response.bias, 1000.0 * a.sensor.response.bias, 1e-9);
  EXPECT_MATRIX_NEAR(1.8 * 1.8 * b.sensor.temperature->bias.col(1),
                     1000.0 * a.sensor.temperature->bias.col(1), 1e-9);
  EXPECT_MATRIX_NEAR(b.fit.statistics->bias_se, 1000.0 * a.fit.statistics->bias_se, 1e-9);
}

TEST(BiasFit, WithoutTemperaturesIsTheMean) {
  RestingSweep sweep("gyroscope", "deg/s", std::vector<double>(20, 20.0));
  for (Reading& reading : sweep.observations.readings) {
    reading.temperature.reset();
  }
  const Calibration record = sweep.fitted();
  EXPECT_FALSE(record.sensor.temperature.has_value());
  const Eigen::MatrixXd& v = sweep.observations.response;
  EXPECT_MATRIX_NEAR(record.sensor.response.bias, Eigen::VectorXd(v.colwise().mean().transpose()),
                     1e-14);
  const double sd = std::sqrt((v.col(1).array() - v.col(1).mean()).square().sum() / 19.0);
  EXPECT_NEAR(record.fit.statistics->residual_sd(1), sd, 1e-13);
  ASSERT_TRUE(record.fit.statistics->components.empty());
  EXPECT_NEAR(record.fit.statistics->bias_se(1), sd / std::sqrt(20.0), 1e-13);
}

TEST(BiasFit, ChoosesTheOrderByAkaike) {
  RestingSweep sweep("gyroscope", "deg/s", mixed_temperatures(60), 3, 1e-4);
  sweep.experiment.fit.temperature.automatic = true;
  const Calibration record = sweep.fitted();
  const std::vector<TemperatureOrderTrial>& trials = record.sensor.temperature->trials;
  ASSERT_EQ(trials.size(), 6U);
  const std::vector<double> temperatures = mixed_temperatures(60);
  for (const TemperatureOrderTrial& trial : trials) {
    const Eigen::MatrixXd X =
        temperature_powers(temperatures, mean_temperature(temperatures), trial.order);
    double aicc = 0.0;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Eigen::VectorXd v = sweep.observations.response.col(k);
      const double rss = (v - X * X.colPivHouseholderQr().solve(v)).squaredNorm();
      const double K = trial.order + 2.0;
      aicc += 60.0 * std::log(rss / 60.0) + 2.0 * K + 2.0 * K * (K + 1.0) / (60.0 - K - 1.0);
    }
    EXPECT_NEAR(trial.aicc, aicc, 1e-5);
  }
  const auto least = std::min_element(trials.begin(), trials.end(),
                                      [](const auto& a, const auto& b) { return a.aicc < b.aicc; });
  EXPECT_EQ(record.sensor.temperature->bias.cols(), least->order);
  EXPECT_GE(least->order, 2);
}

TEST(BiasFit, RefusesTooFewTemperatures) {
  RestingSweep sweep("gyroscope", "deg/s", {10.0, 30.0, 10.0, 30.0, 10.0, 30.0});
  try {
    static_cast<void>(sweep.fitted());
    FAIL() << "a parabola through two temperatures was accepted";
  } catch (const RankDeficientError& error) {
    EXPECT_THAT(error.undetermined(), testing::ElementsAre("x.bias.d2"));
    EXPECT_THAT(error.what(), HasSubstr("readings at 2 temperatures"));
    EXPECT_FALSE(error.settings().empty());
  }
  sweep.experiment.fit.temperature.order = 1;
  EXPECT_NO_THROW(static_cast<void>(sweep.fitted()));
}

TEST(BiasFit, MarksTheReadingsThatItLeftOut) {
  RestingSweep sweep("gyroscope", "deg/s", mixed_temperatures(40));
  sweep.observations.response.row(4).array() += 10.0;
  sweep.experiment.leave_out = {5};
  const Calibration record = sweep.fitted();
  EXPECT_LT(record.fit.statistics->residual_sd.maxCoeff(), 2.0 * sweep_noise);
  ASSERT_EQ(record.fit.residuals.size(), 40U);
  EXPECT_FALSE(record.fit.residuals[4].used);
  EXPECT_TRUE(std::isnan(record.fit.residuals[4].response(0)));
  EXPECT_TRUE(record.fit.residuals[5].used);
  EXPECT_EQ(record.fit.statistics->observations, 39);
}

// ---- the field's part ----

TEST(BiasFit, TakesANominalFieldOut) {
  const DesignPoint point(Face::plus_x, Face::minus_y);
  RestingSweep sweep("accelerometer", "g", mixed_temperatures(40));
  const Calibration without = [&] {
    RestingSweep gyroscope("gyroscope", "deg/s", mixed_temperatures(40));
    return gyroscope.fitted();
  }();
  sweep.lay_at(point, Eigen::Matrix3d::Identity());
  const Calibration record = sweep.fitted();
  EXPECT_MATRIX_NEAR(record.sensor.response.bias, without.sensor.response.bias, 1e-12);
  EXPECT_MATRIX_NEAR(record.sensor.response.sensitivity,
                     SensitivityMatrix(Eigen::Matrix3d::Identity()), 0.0);
  EXPECT_THAT(record.findings.notes, test::HasNote(HasSubstr("its nominal value (1)")));
  EXPECT_TRUE(record.findings.warnings.empty());
}

TEST(BiasFit, TakesTheNominalSensitivityFromTheUnit) {
  RestingSweep sweep("accelerometer", "m/s^2", mixed_temperatures(40));
  sweep.lay_at({Face::minus_z, Face::plus_x}, 9.80665 * Eigen::Matrix3d::Identity());
  const Calibration record = sweep.fitted();
  EXPECT_NEAR(record.sensor.response.sensitivity(1, 1), 9.80665, 1e-12);
  EXPECT_NEAR(record.sensor.response.bias(2), 0.3, 0.2);
}

TEST(BiasFit, WarnsThatTheFieldIsInTheBiases) {
  const RestingSweep sweep("accelerometer", "V", mixed_temperatures(40));
  const Calibration record = sweep.fitted();
  ASSERT_EQ(record.findings.warnings.size(), 1U);
  EXPECT_EQ(record.findings.warnings[0].code, WarningCode::field_in_bias);
}

// A record with a sensitivity and its covariance.
std::shared_ptr<const Calibration> record_with_sensitivity() {
  auto from = std::make_shared<Calibration>();
  from->sensor = test::accelerometer_truth();
  FitStatistics& statistics = from->fit.statistics.emplace();
  RandomStream random(9);
  Eigen::MatrixXd root(12, 12);
  for (double& one : root.reshaped()) {
    one = 1e-3 * random.normal();
  }
  statistics.covariance = root * root.transpose();
  statistics.parameter_names = parameter_names({"x", "y", "z"});
  statistics.interval_dof = Eigen::VectorXd::LinSpaced(12, 11.0, 22.0);
  statistics.sensitivity_se = SensitivityMatrix::Constant(3, 3, 0.01);
  return from;
}

// b = v - S f: the variance of b has the additional term f^T C f, and its covariance with S is -C
// f.
TEST(BiasFit, CountsTheUncertaintyOfTheRecordsSensitivity) {
  const DesignPoint point(Face::plus_y, Face::plus_z);
  RestingSweep sweep("accelerometer", "V", mixed_temperatures(40));
  sweep.experiment.from = record_with_sensitivity();
  const Calibration& from = *sweep.experiment.from;
  RestingSweep plain("gyroscope", "deg/s", mixed_temperatures(40));
  const Calibration without = plain.fitted();
  sweep.lay_at(point, from.sensor.response.sensitivity);
  const Calibration record = sweep.fitted();
  EXPECT_MATRIX_NEAR(record.sensor.response.bias, without.sensor.response.bias, 1e-12);
  EXPECT_MATRIX_NEAR(record.sensor.response.sensitivity, from.sensor.response.sensitivity, 0.0);
  const Eigen::Vector3d met = RestingSweep::met_at(point);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Matrix3d C = from.fit.statistics->covariance.block<3, 3>(4 * k + 1, 4 * k + 1);
    const Eigen::MatrixXd& found = record.fit.statistics->covariance;
    const double own = without.fit.statistics->covariance(3 * k, 3 * k);
    EXPECT_NEAR(found(6 * k, 6 * k), own + met.dot(C * met), 1e-12);
    EXPECT_MATRIX_NEAR(Eigen::Vector3d(found.block<3, 1>(6 * k + 1, 6 * k)),
                       Eigen::Vector3d(-C * met), 1e-15);
    EXPECT_NEAR(record.fit.statistics->bias_se(k), std::sqrt(found(6 * k, 6 * k)), 1e-15);
    EXPECT_EQ(record.fit.statistics->interval_dof(6 * k + 2),
              from.fit.statistics->interval_dof(4 * k + 2));
  }
  EXPECT_EQ(record.fit.statistics->parameter_names[3], "x.sensitivity.z");
  EXPECT_EQ(record.fit.statistics->parameter_names[4], "x.bias.d");
}

TEST(BiasFit, KeepsTheRecordsBiasesIfThePoseIsUnknown) {
  RestingSweep sweep("accelerometer", "V", mixed_temperatures(40));
  sweep.experiment.from = record_with_sensitivity();
  sweep.observations.response.rowwise() += Eigen::RowVector3d(1.0, 1.4, -1.7);
  const Calibration record = sweep.fitted();
  EXPECT_MATRIX_NEAR(record.sensor.response.bias, sweep.experiment.from->sensor.response.bias, 0.0);
  EXPECT_NEAR(record.sensor.temperature->bias(0, 1), 3e-5, 5e-6);
  EXPECT_THAT(record.findings.notes, test::HasNote(HasSubstr("only their change with")));
  EXPECT_TRUE(record.findings.warnings.empty());
}

TEST(BiasFit, RefusesARecordOfOtherAxes) {
  RestingSweep sweep("accelerometer", "V", mixed_temperatures(40));
  auto from = std::make_shared<Calibration>();
  from->sensor.response.bias = Eigen::VectorXd::Zero(2);
  sweep.experiment.from = from;
  EXPECT_THAT(test::complaint_of<SetupError>([&] { static_cast<void>(sweep.fitted()); }),
              HasSubstr("has 2 axes, but the readings have 3"));
}

// ---- long sweeps ----

// Temperatures from -20 to 50 and, if `back`, back to -20.
std::vector<double> slow_sweep(int n, bool back) {
  std::vector<double> all;
  for (int i = 0; i < n; ++i) {
    const double part = static_cast<double>(i) / (n - 1);
    all.push_back(-20.0 + 70.0 * (back ? 1.0 - std::abs(2.0 * part - 1.0) : part));
  }
  return all;
}

const ScatterComponent* component_in(const Calibration& record, std::string_view name) {
  for (const ScatterComponent& one : record.fit.statistics->components) {
    if (one.name == name) {
      return &one;
    }
  }
  return nullptr;
}

TEST(BiasFit, FindsHysteresisBetweenTheWays) {
  RestingSweep sweep("gyroscope", "deg/s", slow_sweep(400, true));
  constexpr double half = 5e-3;
  for (Eigen::Index i = 0; i < 400; ++i) {
    sweep.observations.response(i, 1) += i < 200 ? half : -half;
  }
  const Calibration record = sweep.fitted();
  const ScatterComponent* const found = component_in(record, "hysteresis");
  ASSERT_NE(found, nullptr);
  EXPECT_NEAR(found->sd(1), half, 0.2 * half);
  EXPECT_LT(found->sd(0), 0.2 * half);
  // The bias lies anywhere between the branches (uniform distribution), so its sd is half /
  // sqrt(3).
  EXPECT_NEAR(std::sqrt(found->covariance(3, 3)), half / std::sqrt(3.0), 0.2 * half);
  EXPECT_THAT(record.findings.notes,
              test::HasNote(HasSubstr("at rising and at falling temperature")));
}

TEST(BiasFit, FindsNoHysteresisInWhiteNoise) {
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const RestingSweep sweep("gyroscope", "deg/s", slow_sweep(240, true), seed);
    found += component_in(sweep.fitted(), "hysteresis") != nullptr ? 1 : 0;
  }
  EXPECT_LE(found, 3);
}

TEST(BiasFit, SaysThatOneWayShowsNoHysteresis) {
  const RestingSweep sweep("gyroscope", "deg/s", slow_sweep(300, false));
  const Calibration record = sweep.fitted();
  EXPECT_THAT(record.findings.notes, test::HasNote(HasSubstr("swept in one direction only")));
  EXPECT_EQ(component_in(record, "hysteresis"), nullptr);
}

// If the noise is a slow process, the intervals of the bias are wider than those of white noise.
TEST(BiasFit, CountsNoiseThatWanders) {
  RestingSweep sweep("gyroscope", "deg/s", slow_sweep(100, false));
  RandomStream random(12);
  double state = 0.0;
  for (Eigen::Index i = 0; i < 100; ++i) {
    state = 0.9 * state + 2.0 * sweep_noise * random.normal();
    sweep.observations.response.row(i).array() += state;
  }
  const Calibration record = sweep.fitted();
  ASSERT_NE(component_in(record, "correlation"), nullptr);
  EXPECT_THAT(record.findings.notes,
              test::HasNote(HasSubstr("Consecutive readings are correlated")));
  const std::vector<double> temperatures = slow_sweep(100, false);
  const Eigen::MatrixXd X = temperature_powers(temperatures, mean_temperature(temperatures), 2);
  const double white =
      std::pow(record.fit.statistics->residual_sd(0), 2) * (X.transpose() * X).inverse()(0, 0);
  EXPECT_GT(record.fit.statistics->covariance(0, 0), 3.0 * white);
}

}  // namespace
}  // namespace axiscal
