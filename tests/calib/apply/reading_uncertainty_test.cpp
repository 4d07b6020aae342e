// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/reading_uncertainty.hpp"

#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/units.hpp"
#include "calib/record/parameter_names.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

constexpr double reading_sd = 3e-4;
constexpr double parameter_sd = 1e-4;
constexpr double many_degrees = 1e6;

// A record of a sensor. Its parameters have random, correlated errors with standard deviations of
// about `size`.
Calibration record_with_scatter(const SensorModel& sensor,
                                std::uint64_t seed,
                                double size = parameter_sd) {
  Calibration record;
  record.sensor = sensor;
  std::vector<std::string> also_kinds;
  for (const AlsoResponse& also : sensor.also) {
    also_kinds.push_back(also.kind);
  }
  FitStatistics& statistics = record.fit.statistics.emplace();
  statistics.parameter_names =
      parameter_names(sensor.instrument.axes, also_kinds,
                      sensor.temperature ? static_cast<int>(sensor.temperature->bias.cols()) : 0);
  const auto p = static_cast<Eigen::Index>(statistics.parameter_names.size());
  const Eigen::Index m = sensor.instrument.axis_count();
  RandomStream random(seed);
  const Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(
      p, 2 * p, [&] { return size * random.normal() / std::sqrt(2.0 * static_cast<double>(p)); });
  statistics.covariance = root * root.transpose();
  statistics.degrees_of_freedom = Eigen::VectorXd::Constant(m, many_degrees);
  statistics.residual_sd = Eigen::VectorXd::LinSpaced(m, reading_sd, 2.0 * reading_sd);
  statistics.coverage_factor = Eigen::VectorXd::Constant(m, 2.0);
  fill_intervals(statistics);
  return record;
}

// A record with negligible uncertainties of the parameters.
Calibration exact_record(const SensorModel& sensor) {
  return record_with_scatter(sensor, 1, 1e-12);
}

std::vector<double> reading_in(const SensorModel& sensor,
                               const Eigen::Vector3d& field,
                               const std::optional<SensorTemperature>& temperature = {}) {
  const Eigen::VectorXd v = response_at(sensor, field, temperature);
  return {v.begin(), v.end()};
}

// @return the derivatives of the m readings by the 4 m parameters, m x 4m.
Eigen::MatrixXd change_by_bias_and_sensitivity(Eigen::Index m, const Eigen::Vector3d& f) {
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(m, 4 * m);
  for (Eigen::Index k = 0; k < m; ++k) {
    B.block<1, 4>(k, 4 * k) << 1.0, f.x(), f.y(), f.z();
  }
  return B;
}

// @return the covariance of the readings' errors: the parameters' part and the noise.
Eigen::MatrixXd covariance_of_errors(const Calibration& record, const Eigen::Vector3d& f) {
  const FitStatistics& statistics = *record.fit.statistics;
  const Eigen::MatrixXd B =
      change_by_bias_and_sensitivity(record.sensor.instrument.axis_count(), f);
  Eigen::MatrixXd C = B * statistics.covariance * B.transpose();
  C.diagonal() += statistics.residual_sd.cwiseAbs2();
  return C;
}

const std::vector<Eigen::Vector3d>& fields_read() {
  static const std::vector<Eigen::Vector3d> all = {{0.0, 0.0, 1.0},
                                                   {0.3, -0.4, std::sqrt(0.75)},
                                                   {-0.7, 0.5, -std::sqrt(0.26)},
                                                   {0.1, 0.99, -0.1}};
  return all;
}

SensorModel four_axes() {
  LinearResponse response{.bias = Eigen::Vector4d(0.1, -0.2, 0.05, 0.3),
                          .sensitivity = SensitivityMatrix::Zero(4, 3)};
  // clang-format off
  response.sensitivity << 2.5, 0.1, -0.2,
                          0.1, 2.4,  0.1,
                          0.0, 0.2,  2.6,
                          1.4, 1.5,  1.3;
  // clang-format on
  return test::truth_of(response, "generic");
}

// A sensor with a sensitivity to gravity and with temperature terms of order 2.
SensorModel sensor_with_all_terms() {
  SensorModel sensor = test::accelerometer_truth();
  sensor.instrument.kind = "gyroscope";
  RandomStream random(77);
  const auto small = [&](Eigen::Index columns) {
    return Eigen::MatrixXd(
        Eigen::MatrixXd::NullaryExpr(3, columns, [&] { return 1e-3 * random.normal(); }));
  };
  sensor.temperature =
      TemperatureResponse{.spans = {{.reference = 20.0, .low = -10.0, .high = 60.0}},
                          .bias = small(2),
                          .scale = small(2)};
  sensor.also = {{.kind = "gravity", .unit = "g", .sensitivity = small(3)}};
  return sensor;
}

// Pointers to the sensor's numbers, in the order of its parameter names.
std::vector<double*> places_of_parameters(SensorModel& sensor) {
  std::vector<double*> places;
  for (Eigen::Index k = 0; k < sensor.response.bias.size(); ++k) {
    places.push_back(&sensor.response.bias(k));
    for (Eigen::Index j = 0; j < 3; ++j) {
      places.push_back(&sensor.response.sensitivity(k, j));
    }
    for (AlsoResponse& also : sensor.also) {
      for (Eigen::Index j = 0; j < 3; ++j) {
        places.push_back(&also.sensitivity(k, j));
      }
    }
    if (sensor.temperature) {
      for (Eigen::MatrixXd* terms : {&sensor.temperature->bias, &sensor.temperature->scale}) {
        for (Eigen::Index j = 0; j < terms->cols(); ++j) {
          places.push_back(&(*terms)(k, j));
        }
      }
    }
  }
  return places;
}

// ---- change with parameters ----

TEST(ChangeWithParameters, IsTheDerivativeOfTheReading) {
  const SensorModel sensor = sensor_with_all_terms();
  const Calibration record = record_with_scatter(sensor, 2);
  const Eigen::Vector3d up(0.2, -0.3, 0.9);
  const SensorTemperature temperature = 43.0;
  const Eigen::Vector3d f(0.4, -0.6, 0.7);
  const auto read = [&](const SensorModel& of) {
    return Eigen::VectorXd(response_at(of, f, temperature) + of.also[0].sensitivity * up);
  };
  const Eigen::MatrixXd B =
      change_with_parameters(record, f, {.up = up, .temperature = temperature});
  SensorModel moved = sensor;
  const std::vector<double*> places = places_of_parameters(moved);
  ASSERT_EQ(static_cast<std::size_t>(B.cols()), places.size());
  constexpr double h = 1e-3;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double was = *places[i];
    *places[i] = was + h;
    const Eigen::VectorXd above = read(moved);
    *places[i] = was - h;
    const Eigen::VectorXd change = (above - read(moved)) / (2.0 * h);
    *places[i] = was;
    EXPECT_MATRIX_NEAR(B.col(static_cast<Eigen::Index>(i)), change, 1e-8)
        << record.fit.statistics->parameter_names[i];
  }
}

// If neither a temperature nor the direction of gravity is given, the reading depends on biases and
// sensitivities only.
TEST(ChangeWithParameters, LeavesOutWhatIsNotTold) {
  const Calibration record = record_with_scatter(sensor_with_all_terms(), 3);
  const Eigen::Vector3d f(0.4, -0.6, 0.7);
  const Eigen::MatrixXd B = change_with_parameters(record, f, {});
  const std::vector<std::string>& names = record.fit.statistics->parameter_names;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool counts =
        names[i].ends_with(".bias") || names[i].find(".sensitivity.") != std::string::npos;
    EXPECT_EQ(B.col(static_cast<Eigen::Index>(i)).norm() > 0.0, counts) << names[i];
  }
}

TEST(ChangeWithParameters, NeedsStatistics) {
  Calibration record;
  record.sensor = test::accelerometer_truth();
  EXPECT_THAT(test::complaint_of<DomainError>([&] {
                static_cast<void>(change_with_parameters(record, Eigen::Vector3d::UnitZ(), {}));
              }),
              HasSubstr("lacks statistics"));
}

// ---- components and angles against closed formulas ----

TEST(UncertaintyOfComponents, IsTheInverseTimesTheErrorsOfReadings) {
  const Calibration record = record_with_scatter(test::accelerometer_truth(), 4);
  const Reducer reducer(record);
  const ReadingPropagation propagation(record, reducer);
  const Eigen::Matrix3d inverse = Eigen::Matrix3d(record.sensor.response.sensitivity).inverse();
  for (const Eigen::Vector3d& f : fields_read()) {
    const std::vector<double> v = reading_in(record.sensor, f);
    const Eigen::Matrix3d expected =
        inverse * covariance_of_errors(record, f) * inverse.transpose();
    EXPECT_MATRIX_NEAR(propagation.field_covariance(v), expected, 1e-6 * expected.norm());
    const ReducedUncertainty u = propagation.at(v);
    EXPECT_MATRIX_NEAR(u.field_in_sensor, expected.diagonal().cwiseSqrt(), 1e-9);
    const Eigen::Vector3d n = f.normalized();
    EXPECT_NEAR(u.residual / std::sqrt(n.dot(expected * n)), 1.0, 1e-4);
    EXPECT_NEAR(u.expanded.field_in_sensor.x() / u.field_in_sensor.x(), 1.959964, 1e-3);
  }
}

TEST(UncertaintyOfComponents, OfMoreAxesIsThatOfWeightedLeastSquares) {
  const Calibration record = record_with_scatter(four_axes(), 5);
  const Reducer reducer(record);
  const ReadingPropagation propagation(record, reducer);
  const SensitivityMatrix& S = record.sensor.response.sensitivity;
  const Eigen::MatrixXd W =
      record.fit.statistics->residual_sd.cwiseAbs2().cwiseInverse().asDiagonal();
  const Eigen::MatrixXd P = (S.transpose() * W * S).inverse() * S.transpose() * W;
  for (const Eigen::Vector3d& f : fields_read()) {
    const Eigen::Matrix3d expected = P * covariance_of_errors(record, f) * P.transpose();
    EXPECT_MATRIX_NEAR(propagation.field_covariance(reading_in(record.sensor, f)), expected,
                       1e-6 * expected.norm());
  }
}

// pitch = asin(f_x / F), roll = atan2(f_y, f_z).
TEST(UncertaintyOfAngles, FollowsFromTheComponents) {
  const Calibration record = record_with_scatter(test::accelerometer_truth(), 6);
  const Reducer reducer(record);
  const ReadingPropagation propagation(record, reducer);
  for (const Eigen::Vector3d& f : fields_read()) {
    const std::vector<double> v = reading_in(record.sensor, f);
    const Eigen::Matrix3d C = propagation.field_covariance(v);
    const ReducedUncertainty u = propagation.at(v);
    const double pitch = std::asin(f.x());
    const double expected_pitch = std::sqrt(C(0, 0)) / std::cos(pitch) * deg_per_rad;
    EXPECT_NEAR(u.derived[0] / expected_pitch, 1.0, 1e-3);
    const Eigen::Vector3d by_field =
        Eigen::Vector3d(0.0, f.z(), -f.y()) / (f.y() * f.y() + f.z() * f.z());
    const double expected_roll = std::sqrt(by_field.dot(C * by_field)) * deg_per_rad;
    EXPECT_NEAR(u.derived[1] / expected_roll, 1.0, 1e-3);
    EXPECT_TRUE(std::isnan(u.derived[2])) << "no yaw";
  }
}

// Readings with random errors, of sensors with random parameters, are reduced with the record. The
// stated uncertainty is the spread of the results.
TEST(UncertaintyOfReadings, IsTheSpreadOfDrawnSensors) {
  const Calibration record = record_with_scatter(test::accelerometer_truth(), 7, 3e-4);
  const FitStatistics& statistics = *record.fit.statistics;
  const Reducer reducer(record);
  const Eigen::MatrixXd root = Eigen::LLT<Eigen::MatrixXd>(statistics.covariance).matrixL();
  const Eigen::Vector3d f(0.3, -0.4, std::sqrt(0.75));
  const ReducedReading here = reducer.reduce(reading_in(record.sensor, f));
  constexpr int trials = 20000;
  RandomStream random(8);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(6);
  for (int i = 0; i < trials; ++i) {
    SensorModel drawn = record.sensor;
    const Eigen::VectorXd errors = root * random.normals<12>();
    const std::vector<double*> places = places_of_parameters(drawn);
    for (std::size_t j = 0; j < places.size(); ++j) {
      *places[j] += errors(static_cast<Eigen::Index>(j));
    }
    std::vector<double> v = reading_in(drawn, f);
    for (std::size_t k = 0; k < 3; ++k) {
      v[k] += statistics.residual_sd(static_cast<Eigen::Index>(k)) * random.normal();
    }
    const ReducedReading reduced = reducer.reduce(v);
    Eigen::VectorXd error(6);
    error << reduced.field_in_sensor - here.field_in_sensor, reduced.residual - here.residual,
        reduced["pitch_deg"] - here["pitch_deg"], reduced["roll_deg"] - here["roll_deg"];
    squares += error.cwiseAbs2();
  }
  const Eigen::VectorXd spread = (squares / trials).cwiseSqrt();
  const ReducedUncertainty u = ReadingPropagation(record, reducer).at(reading_in(record.sensor, f));
  Eigen::VectorXd stated(6);
  stated << u.field_in_sensor, u.residual, u.derived[0], u.derived[1];
  for (Eigen::Index r = 0; r < 6; ++r) {
    EXPECT_NEAR(spread(r) / stated(r), 1.0, 0.03) << r;
  }
}

// ---- the length of the field ----

TEST(ChangeOfLength, IsTheDerivativeByEachParameter) {
  SensorModel sensor = sensor_with_all_terms();
  sensor.also.clear();
  const Calibration record = record_with_scatter(sensor, 9);
  const SensorTemperature temperature = 35.0;
  const std::vector<double> v = reading_in(sensor, {0.5, 0.4, -0.7}, temperature);
  const Reducer reducer(record);
  const ReadingPropagation::LengthChange change =
      ReadingPropagation(record, reducer).length_change(v, temperature);
  const auto length_by = [&](const SensorModel& of) {
    return Reducer(of).reduce(v, {.temperature = temperature}).field_in_sensor.norm();
  };
  EXPECT_NEAR(change.length, std::sqrt(0.9), 1e-12);
  EXPECT_MATRIX_NEAR(change.direction, Eigen::Vector3d(0.5, 0.4, -0.7) / std::sqrt(0.9), 1e-12);
  SensorModel moved = sensor;
  const std::vector<double*> places = places_of_parameters(moved);
  for (std::size_t i = 0; i < places.size(); ++i) {
    constexpr double h = 1e-6;
    const double was = *places[i];
    *places[i] = was + h;
    const double above = length_by(moved);
    *places[i] = was - h;
    const double slope = (above - length_by(moved)) / (2.0 * h);
    *places[i] = was;
    EXPECT_NEAR(change.by_parameters(static_cast<Eigen::Index>(i)), slope,
                1e-5 * std::max(1.0, std::abs(slope)))
        << record.fit.statistics->parameter_names[i];
  }
}

TEST(ChangeOfLength, HasTheScatterOfAReadingAlone) {
  const Calibration record = record_with_scatter(test::accelerometer_truth(), 10);
  const Reducer reducer(record);
  const Eigen::Vector3d f(0.3, -0.4, 0.8);
  const Eigen::Matrix3d inverse = Eigen::Matrix3d(record.sensor.response.sensitivity).inverse();
  const Eigen::Vector3d by_readings = inverse.transpose() * f.normalized();
  const double expected =
      by_readings.cwiseAbs2().dot(record.fit.statistics->residual_sd.cwiseAbs2());
  EXPECT_NEAR(ReadingPropagation(record, reducer)
                      .length_change(reading_in(record.sensor, f))
                      .reading_variance /
                  expected,
              1.0, 1e-5);
}

// ---- the noise of new readings ----

TEST(NoiseOfReadings, IsTheResolutionIfThatIsCoarser) {
  const Calibration record = exact_record(test::accelerometer_truth());
  const Reducer reducer(record);
  const std::vector<double> v = reading_in(record.sensor, {0.3, -0.4, 0.8});
  const auto covariance = [&](const ReadingNoise& noise) {
    return ReadingPropagation(record, reducer, noise).field_covariance(v);
  };
  const Eigen::Matrix3d inverse = Eigen::Matrix3d(record.sensor.response.sensitivity).inverse();
  constexpr double step = 0.01;  // step / sqrt(12) = 2.9e-3, more than the noise of any axis
  EXPECT_MATRIX_NEAR(covariance({.resolution = step}),
                     step * step / 12.0 * inverse * inverse.transpose(), 1e-11);
  EXPECT_MATRIX_NEAR(covariance({.resolution = reading_sd}), covariance({}), 1e-16);
}

// The error u_t of the temperature changes a reading by (b' + s' S f) u_t.
TEST(NoiseOfReadings, GrowsWithThatOfTheTemperature) {
  SensorModel sensor = test::accelerometer_truth();
  sensor.temperature = TemperatureResponse{.spans = {{.reference = 20.0}},
                                           .bias = Eigen::Vector3d(2e-3, -1e-3, 5e-4),
                                           .scale = Eigen::Vector3d(1e-3, 2e-3, -3e-3)};
  const Calibration record = exact_record(sensor);
  const Reducer reducer(record);
  const Eigen::Vector3d f(0.3, -0.4, 0.8);
  const SensorTemperature warm = 30.0;
  constexpr double u_t = 0.2;
  const ReadingPropagation propagation(record, reducer, {.temperature_u = u_t});
  Eigen::Vector3d variance;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double slope =
        sensor.temperature->bias(k, 0) +
        sensor.temperature->scale(k, 0) * sensor.response.sensitivity.row(k).dot(f);
    const double scale = 1.0 + 10.0 * sensor.temperature->scale(k, 0);
    variance(k) = (std::pow(record.fit.statistics->residual_sd(k), 2) + std::pow(slope * u_t, 2)) /
                  (scale * scale);
  }
  const Eigen::Matrix3d inverse = Eigen::Matrix3d(sensor.response.sensitivity).inverse();
  const Eigen::Matrix3d expected = inverse * variance.asDiagonal() * inverse.transpose();
  EXPECT_MATRIX_NEAR(propagation.field_covariance(reading_in(sensor, f, warm), warm), expected,
                     1e-6 * expected.norm());
}

// If the noise is the scatter of few readings, the factor is Student's t. If the noise is stated,
// the factor is that of a normal distribution.
TEST(NoiseOfReadings, HasTheDegreesOfFreedomOfItsSource) {
  Calibration record = exact_record(test::accelerometer_truth());
  record.fit.statistics->degrees_of_freedom = Eigen::Vector3d::Constant(4.0);
  record.sensor.response.sensitivity = 2.0 * Eigen::Matrix3d::Identity();
  const Reducer reducer(record);
  const std::vector<double> v = reading_in(record.sensor, {0.3, -0.4, 0.8});
  const auto factor = [&](const ReadingNoise& noise, double probability) {
    const ReducedUncertainty u = ReadingPropagation(record, reducer, noise, 1.0, probability).at(v);
    return u.expanded.field_in_sensor.y() / u.field_in_sensor.y();
  };
  const ReadingNoise stated{.sd = Eigen::Vector3d::Constant(1e-3)};
  EXPECT_NEAR(factor({}, 0.95), 2.776445, 5e-3 * 2.776445);
  EXPECT_NEAR(factor({}, 0.99), 4.604095, 5e-3 * 4.604095);
  EXPECT_NEAR(factor(stated, 0.95), 1.959964, 5e-3);
  EXPECT_NEAR(factor(stated, 0.99), 2.575829, 5e-3);
}

TEST(NoiseOfReadings, IsThatOfTheRecordsStatement) {
  Calibration record = exact_record(test::accelerometer_truth());
  EXPECT_EQ(stated_noise(record).resolution, 0.0);
  record.fit.uncertainty.emplace();
  record.fit.uncertainty->resolution = 1e-3;
  record.fit.uncertainty->temperature_u = 0.5;
  EXPECT_EQ(stated_noise(record).resolution, 1e-3);
  EXPECT_EQ(stated_noise(record).temperature_u, 0.5);
  EXPECT_FALSE(stated_noise(record).sd);
}

TEST(NoiseOfReadings, MustBeKnown) {
  Calibration record = exact_record(test::accelerometer_truth());
  const Reducer reducer(record);
  const auto complaint = [&](const ReadingNoise& noise = {}, double probability = 0.95) {
    return test::complaint_of<DomainError>(
        [&] { ReadingPropagation(record, reducer, noise, 1.0, probability); });
  };
  EXPECT_EQ(complaint(), "accepted");
  EXPECT_THAT(complaint({.sd = Eigen::Vector2d(1e-3, 1e-3)}), HasSubstr("standard deviation"));
  EXPECT_THAT(complaint({.sd = Eigen::Vector3d(1e-3, -1e-3, 1e-3)}),
              HasSubstr("standard deviation"));
  EXPECT_THAT(complaint({}, 1.0), HasSubstr("between 0 and 1"));
  record.fit.statistics->residual_sd(1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(complaint(), HasSubstr("scatter of a reading is not known"));
  record.fit.statistics->covariance(2, 2) = std::numeric_limits<double>::infinity();
  EXPECT_THAT(complaint(), HasSubstr("lacks the covariance"));
  record.fit.statistics.reset();
  EXPECT_THAT(complaint(), HasSubstr("lacks the covariance"));
}

// ---- the field's magnitude ----

TEST(MagnitudeOfTheField, CountsInComponentsAndNotInAngles) {
  const Calibration plain = record_with_scatter(test::accelerometer_truth(), 11);
  Calibration record = plain;
  constexpr double relative_u = 2e-3;
  record.sensor.field.magnitude_u = relative_u;
  Eigen::VectorXd by_magnitude = Eigen::VectorXd::Zero(12);
  for (Eigen::Index k = 0; k < 3; ++k) {
    by_magnitude.segment<3>(4 * k + 1) =
        relative_u * record.sensor.response.sensitivity.row(k).transpose();
  }
  record.fit.uncertainty.emplace().sources = {
      {.name = "fit", .type = "A"},
      {.name = field_magnitude_source,
       .type = "B",
       .covariance = by_magnitude * by_magnitude.transpose()}};
  const Eigen::Vector3d f(0.3, -0.4, std::sqrt(0.75));
  const std::vector<double> v = reading_in(record.sensor, f);
  const Reducer reducer(record);
  const ReducedUncertainty without = ReadingPropagation(plain, reducer).at(v);
  const ReducedUncertainty with = ReadingPropagation(record, reducer).at(v);
  for (Eigen::Index j = 0; j < 3; ++j) {
    EXPECT_NEAR(with.field_in_sensor(j), std::hypot(without.field_in_sensor(j), relative_u * f(j)),
                1e-8);
  }
  EXPECT_NEAR(with.derived[0], without.derived[0], 1e-6 * without.derived[0]);
  EXPECT_NEAR(with.derived[1], without.derived[1], 1e-6 * without.derived[1]);
  EXPECT_NEAR(with.residual, without.residual, 1e-6 * without.residual);
}

// At another place F is less certain. The pitch changes by tan(pitch) dF / F, and the roll does not
// change.
TEST(MagnitudeOfTheField, ElsewhereCountsInResidualAndPitch) {
  const Calibration record = record_with_scatter(test::accelerometer_truth(), 12);
  const Reducer reducer(record);
  const Eigen::Vector3d f(0.5, -0.5, std::sqrt(0.5));
  const std::vector<double> v = reading_in(record.sensor, f);
  ReadingPropagation propagation(record, reducer);
  const ReducedUncertainty here = propagation.at(v);
  const Eigen::Matrix3d covariance_here = propagation.field_covariance(v);
  constexpr double component_u = 1e-3;
  constexpr double ratio_u = 2e-3;
  propagation.set_field_u({.component_u = component_u, .ratio_u = ratio_u});
  const ReducedUncertainty there = propagation.at(v);
  for (Eigen::Index j = 0; j < 3; ++j) {
    EXPECT_NEAR(there.field_in_sensor(j), std::hypot(here.field_in_sensor(j), component_u * f(j)),
                1e-9);
  }
  EXPECT_NEAR(there.residual, std::hypot(here.residual, ratio_u), 1e-8);
  const double by_pitch = std::tan(std::asin(0.5)) * ratio_u * deg_per_rad;
  EXPECT_NEAR(there.derived[0], std::hypot(here.derived[0], by_pitch), 1e-5);
  EXPECT_NEAR(there.derived[1], here.derived[1], 1e-9);
  EXPECT_MATRIX_NEAR(propagation.field_covariance(v),
                     covariance_here + component_u * component_u * f * f.transpose(), 1e-12);
}

// Uncertainties are in the unit of the results. Those of angles do not change.
TEST(MagnitudeOfTheField, ScalesUncertaintiesWithTheUnit) {
  const Calibration record = record_with_scatter(test::accelerometer_truth(), 13);
  constexpr double factor = 9.81;
  const Reducer in_g(record);
  const Reducer in_si(record, {.magnitude = factor, .factor = factor});
  const std::vector<double> v = reading_in(record.sensor, {0.5, -0.5, std::sqrt(0.5)});
  const ReducedUncertainty u = ReadingPropagation(record, in_g).at(v);
  const ReadingPropagation si(record, in_si, {}, factor);
  EXPECT_MATRIX_NEAR(si.at(v).field_in_sensor, factor * u.field_in_sensor, 1e-9);
  EXPECT_MATRIX_NEAR(si.at(v).expanded.field_in_sensor, factor * u.expanded.field_in_sensor, 1e-9);
  EXPECT_NEAR(si.at(v).residual, factor * u.residual, 1e-8);
  EXPECT_NEAR(si.at(v).derived[0], u.derived[0], 1e-8);
  EXPECT_NEAR(si.at(v).derived[1], u.derived[1], 1e-8);
  EXPECT_NEAR(si.length_change(v).length, 1.0, 1e-12) << "in the record's unit";
}

// ---- later blocks ----

// A later reading is of another block. This adds max(M - s^2 c, 0) for each bias and f_l^2 times
// that for each sensitivity.
TEST(LaterBlocks, AddTheScatterBetweenBlocks) {
  Calibration record = record_with_scatter(test::accelerometer_truth(), 14);
  const Eigen::VectorXd variances = record.fit.statistics->covariance.diagonal();
  CalibrationConditions& conditions = record.fit.conditions;
  conditions.blocks = 3;
  conditions.block_mean_square = Eigen::Vector3d(1e-6, 2e-6, 1e-12);
  conditions.block_degrees_of_freedom = 2.0;
  conditions.sensitivity_mean_square = 3e-6 * Eigen::Matrix3d::Ones();
  conditions.sensitivity_degrees_of_freedom = 2.0;
  const Eigen::Vector3d f(0.3, -0.4, std::sqrt(0.75));
  const Reducer reducer(record);
  Eigen::MatrixXd C = covariance_of_errors(record, f);
  for (Eigen::Index k = 0; k < 3; ++k) {
    C(k, k) += std::max(conditions.block_mean_square(k) - 3.0 * variances(4 * k), 0.0);
    for (Eigen::Index l = 0; l < 3; ++l) {
      C(k, k) += f(l) * f(l) * std::max(3e-6 - 3.0 * variances(4 * k + 1 + l), 0.0);
    }
  }
  const Eigen::Matrix3d inverse = Eigen::Matrix3d(record.sensor.response.sensitivity).inverse();
  const Eigen::Matrix3d expected = inverse * C * inverse.transpose();
  const ReadingPropagation propagation(record, reducer);
  const std::vector<double> v = reading_in(record.sensor, f);
  EXPECT_MATRIX_NEAR(propagation.field_covariance(v), expected, 1e-6 * expected.norm());
  const ReducedUncertainty u = propagation.at(v);
  EXPECT_MATRIX_NEAR(u.field_in_sensor, expected.diagonal().cwiseSqrt(), 1e-8);
  // With two degrees of freedom the coverage factor is above 3.
  EXPECT_GT(u.expanded.field_in_sensor.y() / u.field_in_sensor.y(), 3.0);
}

// ---- headings ----

// The direction of up is uncertain too. The stated uncertainty is the spread of headings for random
// directions of up.
TEST(UncertaintyOfHeadings, HasTheScatterOfUp) {
  SensorModel sensor = test::accelerometer_truth();
  sensor.instrument.kind = "magnetometer";
  const Calibration record = exact_record(sensor);
  const Reducer reducer(record);
  const ReadingPropagation propagation(record, reducer, {.sd = Eigen::Vector3d::Constant(1e-9)});
  const std::vector<double> v = reading_in(sensor, {0.4, 0.1, -std::sqrt(0.83)});
  const Eigen::Vector3d up(0.1, -0.05, std::sqrt(1.0 - 0.0125));
  Eigen::Matrix3d root;
  root << 2e-3, 0.0, 0.0, 1e-3, 3e-3, 0.0, -5e-4, 1e-3, 1e-3;
  const auto derived_with = [&](const Eigen::Vector3d& by) {
    return reducer.reduce(v, {.up = by}).derived.values;
  };
  const auto here = derived_with(up);
  const ReducedUncertainty u =
      propagation.at(v, {.up = up, .up_covariance = root * root.transpose()});
  constexpr int trials = 20000;
  RandomStream random(15);
  std::array<double, 4> squares{};
  for (int i = 0; i < trials; ++i) {
    const auto drawn = derived_with(up + root * random.normals<3>());
    for (std::size_t r = 0; r < squares.size(); ++r) {
      squares[r] += std::pow(std::remainder(drawn[r] - here[r], 360.0), 2) / trials;
    }
  }
  int compared = 0;
  for (std::size_t r = 0; r < reducer.kind().derived_names.size(); ++r) {
    if (std::isfinite(here[r]) && squares[r] > 0.0) {
      EXPECT_NEAR(u.derived[r] / std::sqrt(squares[r]), 1.0, 0.03)
          << reducer.kind().derived_names[r];
      ++compared;
    }
  }
  EXPECT_GE(compared, 1);
}

// ---- fewer than three axes ----

// An inclinometer with one axis. The errors of its parameters are independent and equally large.
Calibration record_of_one_axis() {
  LinearResponse response{.bias = Eigen::VectorXd::Constant(1, 0.1),
                          .sensitivity = SensitivityMatrix(1, 3)};
  response.sensitivity << 2.0, 0.5, -1.0;
  Calibration record = record_with_scatter(test::truth_of(response, "inclinometer"), 16);
  record.fit.statistics->covariance = parameter_sd * parameter_sd * Eigen::Matrix4d::Identity();
  return record;
}

// The field has the length F, so equal and independent errors of S have the same effect in every
// attitude.
TEST(UncertaintyOfOneAxis, IsThatOfBiasNoiseAndAFieldOfLengthF) {
  const Calibration record = record_of_one_axis();
  const Reducer reducer(record);
  const ReadingPropagation propagation(record, reducer);
  const double S = record.sensor.response.sensitivity.norm();
  const double noise = record.fit.statistics->residual_sd(0);
  const double expected = std::sqrt(noise * noise + 2.0 * parameter_sd * parameter_sd) / S;
  for (const double component : {-0.9, -0.3, 0.0, 0.5, 0.99}) {
    const ReadingPropagation::Axis u = propagation.at_axis(0, 0.1 + component * S);
    EXPECT_NEAR(u.component, expected, 1e-9) << component;
    EXPECT_NEAR(u.angle_rad, expected / std::sqrt(1.0 - component * component), 2e-6) << component;
    EXPECT_NEAR(u.coverage_factor, 1.959964, 1e-3);
  }
}

// Near the vertical the cosine of the angle's error is 1 - u / F, so the uncertainty of the angle
// is sqrt(2 u / F).
TEST(UncertaintyOfOneAxis, OfAVerticalAxisIsAnAngleAtThePole) {
  const Calibration record = record_of_one_axis();
  const Reducer reducer(record);
  const double S = record.sensor.response.sensitivity.norm();
  const ReadingPropagation propagation(record, reducer);
  for (const double component : {1.0, 1.5, -1.2}) {
    const ReadingPropagation::Axis u = propagation.at_axis(0, 0.1 + component * S);
    EXPECT_GE(u.angle_rad, std::sqrt(2.0 * u.component) * (1.0 - 1e-6)) << component;
    EXPECT_LE(u.angle_rad, 1.5 * std::sqrt(2.0 * u.component)) << component;
  }
}

TEST(UncertaintyOfOneAxis, GrowsWithTheFieldsThere) {
  const Calibration record = record_of_one_axis();
  const Reducer reducer(record);
  const double S = record.sensor.response.sensitivity.norm();
  ReadingPropagation propagation(record, reducer);
  const double reading = 0.1 + 0.6 * S;
  const ReadingPropagation::Axis here = propagation.at_axis(0, reading);
  propagation.set_field_u({.component_u = 1e-3, .ratio_u = 2e-3});
  const ReadingPropagation::Axis there = propagation.at_axis(0, reading);
  EXPECT_NEAR(there.component, std::hypot(here.component, 0.6e-3), 1e-9);
  EXPECT_NEAR(there.angle_rad, std::hypot(here.component, 1.2e-3) / 0.8, 1e-6);
}

// ---- directions ----

// If the axes have equal noise, the uncertainty of the direction is k sigma / (S F) for every
// direction.
TEST(UncertaintyOfDirections, IsTheSameAllRoundForEqualAxes) {
  SensorModel sensor = test::accelerometer_truth();
  sensor.response.sensitivity = 2.0 * Eigen::Matrix3d::Identity();
  Calibration record = exact_record(sensor);
  record.fit.statistics->residual_sd = Eigen::Vector3d::Constant(reading_sd);
  record.fit.statistics->coverage_factor = Eigen::Vector3d(2.0, 2.2, 2.1);
  const Reducer reducer(record);
  const ReadingPropagation propagation(record, reducer);
  const double expected = 2.2 * reading_sd / 2.0 * deg_per_rad;
  for (const Eigen::Vector3d& f : fields_read()) {
    EXPECT_NEAR(direction_uncertainty_deg(record, propagation, f.normalized()), expected,
                1e-6 * expected);
  }
}

// A noisy axis affects the direction unless the field is parallel to it.
TEST(UncertaintyOfDirections, IsThatOfTheWorstAxisAcrossTheField) {
  SensorModel sensor = test::accelerometer_truth();
  sensor.response.sensitivity = 2.0 * Eigen::Matrix3d::Identity();
  Calibration record = exact_record(sensor);
  record.fit.statistics->residual_sd = Eigen::Vector3d(1e-4, 2e-4, 8e-4);
  const Reducer reducer(record);
  const ReadingPropagation propagation(record, reducer);
  const auto along = [&](int axis) {
    return direction_uncertainty_deg(record, propagation, Eigen::Vector3d::Unit(axis));
  };
  const double unit = 2.0 / 2.0 * deg_per_rad;
  EXPECT_NEAR(along(0), 8e-4 * unit, 1e-6);
  EXPECT_NEAR(along(1), 8e-4 * unit, 1e-6);
  EXPECT_NEAR(along(2), 2e-4 * unit, 1e-6);
}

}  // namespace
}  // namespace axiscal
