// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gmock/gmock.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

constexpr double gravity_here = 9.807;
constexpr double gravity_there = 9.780;

FieldDescription gravity_in_g() {
  return {.kind = "gravity", .unit = "g", .magnitude = 1.0, .local_gravity = gravity_here};
}

FieldDescription gravity_in_si(double u = 0.0) {
  return {.kind = "gravity", .unit = "m/s^2", .magnitude = gravity_here, .magnitude_u = u};
}

FieldDescription field_in_nanotesla(double u = 0.0) {
  return {.kind = "geomagnetic", .unit = "nT", .magnitude = 48000.0, .magnitude_u = u};
}

// ---- factors ----

TEST(ConversionOfFields, KeepsTheUnitIfNoneIsStated) {
  for (const FieldDescription& field : {gravity_in_g(), gravity_in_si(), field_in_nanotesla()}) {
    const FieldConversion same = field_conversion(field, "");
    EXPECT_EQ(same.unit, field.unit);
    EXPECT_EQ(same.factor, 1.0);
    EXPECT_EQ(same.magnitude, field.magnitude);
    EXPECT_EQ(same.component_u, 0.0);
    EXPECT_EQ(same.ratio_u, 0.0);
  }
}

TEST(ConversionOfFields, KnowsTheUnitsOfOneQuantity) {
  const auto converts = [](const std::string& from, const std::string& to, double factor) {
    const FieldDescription field{.kind = "custom", .unit = from, .magnitude = 7.0};
    const FieldConversion conversion = field_conversion(field, to);
    EXPECT_NEAR(conversion.factor / factor, 1.0, 1e-14) << from << ' ' << to;
    EXPECT_NEAR(conversion.magnitude / (7.0 * factor), 1.0, 1e-14) << from << ' ' << to;
    EXPECT_EQ(conversion.unit, to);
  };
  converts("nT", "uT", 1e-3);
  converts("T", "nT", 1e9);
  converts("G", "uT", 100.0);
  converts("mG", "nT", 100.0);
  converts("deg/s", "rad/s", std::numbers::pi / 180.0);
  converts("deg/s", "deg/h", 3600.0);
  converts("rad/s", "deg/h", 3600.0 * 180.0 / std::numbers::pi);
}

TEST(ConversionOfFields, RefusesAnotherQuantity) {
  const auto complaint = [](const FieldDescription& field, const std::string& unit) {
    return test::complaint_of<DomainError>(
        [&] { static_cast<void>(field_conversion(field, unit)); });
  };
  EXPECT_THAT(complaint(gravity_in_g(), "nT"), HasSubstr("'g' cannot be converted to 'nT'"));
  EXPECT_THAT(complaint(gravity_in_si(), "deg/s"), HasSubstr("'m/s^2'"));
  EXPECT_THAT(complaint(field_in_nanotesla(), "g"), HasSubstr("cannot be converted"));
  EXPECT_THAT(complaint(field_in_nanotesla(), "furlong"), HasSubstr("'furlong'"));
  FieldDescription nowhere = gravity_in_g();
  nowhere.local_gravity.reset();
  EXPECT_THAT(complaint(nowhere, "m/s^2"), HasSubstr("does not state local gravity"));
  EXPECT_EQ(complaint(nowhere, "g"), "accepted");
}

TEST(ConversionOfGravity, GoesByTheGravityOfThePlace) {
  const FieldConversion to_si = field_conversion(gravity_in_g(), "m/s^2");
  EXPECT_DOUBLE_EQ(to_si.factor, gravity_here);
  EXPECT_DOUBLE_EQ(to_si.magnitude, gravity_here);
  const FieldConversion to_g = field_conversion(gravity_in_si(), "g");
  EXPECT_DOUBLE_EQ(to_g.factor, 1.0 / gravity_here);
  EXPECT_EQ(to_g.magnitude, 1.0);
}

// 1 g at the place of the calibration is less than 1 g at a place of stronger gravity.
TEST(ConversionOfGravity, GoesFromOnePlaceToAnother) {
  const FieldAtReadings there{.gravity_m_s2 = gravity_there};
  const FieldConversion g_to_g = field_conversion(gravity_in_g(), "g", there);
  EXPECT_DOUBLE_EQ(g_to_g.factor, gravity_here / gravity_there);
  EXPECT_EQ(g_to_g.magnitude, 1.0);
  const FieldConversion g_to_si = field_conversion(gravity_in_g(), "m/s^2", there);
  EXPECT_DOUBLE_EQ(g_to_si.factor, gravity_here);
  EXPECT_DOUBLE_EQ(g_to_si.magnitude, gravity_there);
  const FieldConversion si_to_g = field_conversion(gravity_in_si(), "g", there);
  EXPECT_DOUBLE_EQ(si_to_g.factor, 1.0 / gravity_there);
  EXPECT_EQ(si_to_g.magnitude, 1.0);
  const FieldConversion si_to_si = field_conversion(gravity_in_si(), "m/s^2", there);
  EXPECT_EQ(si_to_si.factor, 1.0);
  EXPECT_DOUBLE_EQ(si_to_si.magnitude, gravity_there);
}

TEST(ConversionOfGravity, TakesAStatedMagnitude) {
  EXPECT_EQ(field_conversion(gravity_in_g(), "g", {.magnitude = 1.002}).magnitude, 1.002);
  EXPECT_EQ(field_conversion(gravity_in_g(), "m/s^2", {.magnitude = 9.7}).magnitude, 9.7);
  const FieldConversion magnetic =
      field_conversion(field_in_nanotesla(), "uT", {.magnitude = 31.0});
  EXPECT_EQ(magnetic.magnitude, 31.0);
  EXPECT_NEAR(magnetic.factor, 1e-3, 1e-18);
}

// ---- uncertainties of the fields ----

TEST(UncertaintyOfConversion, IsThatOfTheFieldInItsUnit) {
  const double here_u = 1e-3 / gravity_here;
  FieldDescription in_g = gravity_in_g();
  in_g.local_gravity_u = 1e-3;
  // In g the local field is exact; in m/s^2 it has the uncertainty of local gravity.
  EXPECT_EQ(field_conversion(in_g, "g").component_u, 0.0);
  EXPECT_NEAR(field_conversion(in_g, "m/s^2").component_u, here_u, 1e-15);
  EXPECT_NEAR(field_conversion(gravity_in_si(1e-3), "").component_u, here_u, 1e-15);
  EXPECT_EQ(field_conversion(gravity_in_si(1e-3), "g").component_u, 0.0);
  EXPECT_NEAR(field_conversion(field_in_nanotesla(96.0), "uT").component_u, 2e-3, 1e-15);
  // At the place of the calibration the ratio of a component to F has no uncertainty.
  for (const FieldConversion& here :
       {field_conversion(in_g, "m/s^2"), field_conversion(gravity_in_si(1e-3), "g"),
        field_conversion(field_in_nanotesla(96.0), "uT")}) {
    EXPECT_EQ(here.ratio_u, 0.0);
  }
}

TEST(UncertaintyOfConversion, ElsewhereIsThatOfBothPlaces) {
  const FieldAtReadings there{.gravity_m_s2 = gravity_there, .gravity_u_m_s2 = 2e-3};
  const double here_u = 1e-3 / gravity_here;
  const double there_u = 2e-3 / gravity_there;
  const FieldConversion to_g = field_conversion(gravity_in_si(1e-3), "g", there);
  EXPECT_NEAR(to_g.component_u, std::hypot(here_u, there_u), 1e-15);
  EXPECT_NEAR(to_g.ratio_u, std::hypot(here_u, there_u), 1e-15);
  const FieldConversion to_si = field_conversion(gravity_in_si(1e-3), "m/s^2", there);
  EXPECT_NEAR(to_si.component_u, here_u, 1e-15);
  EXPECT_NEAR(to_si.ratio_u, std::hypot(here_u, there_u), 1e-15);
  // If the place of the readings is the place of the calibration, no uncertainty is added.
  const FieldConversion again = field_conversion(
      gravity_in_si(1e-3), "g", {.gravity_m_s2 = gravity_here, .gravity_u_m_s2 = 5.0});
  EXPECT_EQ(again.component_u, 0.0);
  EXPECT_EQ(again.ratio_u, 0.0);
  const FieldConversion magnetic =
      field_conversion(field_in_nanotesla(96.0), "uT", {.magnitude = 30.0, .magnitude_u = 0.09});
  EXPECT_NEAR(magnetic.component_u, 2e-3, 1e-15);
  EXPECT_NEAR(magnetic.ratio_u, std::hypot(2e-3, 3e-3), 1e-15);
}

// ---- records in another unit ----

Calibration record_in_si(std::uint64_t seed = 3) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  experiment.table.site = Site{.latitude_deg = 48.0};
  experiment.fit.method = Method::joint;
  experiment.fit.seats = SeatSetup::none;
  experiment.field.magnitude_u = 1e-4;
  experiment.positioner = test::uncertain_cube(2e-4);
  return calibrate(experiment,
                   test::observe(truth, {.replicates = 2, .noise_sd = 1e-4, .seed = seed}));
}

TEST(ConvertedRecord, ReadsTheSameInItsNewUnit) {
  const Calibration record = record_in_si();
  const FieldConversion conversion = field_conversion(record.sensor.field, "m/s^2");
  const Calibration other = converted(record, conversion);
  EXPECT_EQ(other.sensor.field.unit, "m/s^2");
  EXPECT_DOUBLE_EQ(other.sensor.field.magnitude, conversion.magnitude);
  const Reducer one(record);
  const Reducer two(other);
  RandomStream random(5);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d f = random.normals<3>().normalized();
    const Eigen::VectorXd v = record.sensor.response.at(f);
    const ReducedReading a = one.reduce({v.data(), 3});
    const ReducedReading b = two.reduce({v.data(), 3});
    EXPECT_MATRIX_NEAR(b.field_in_sensor, conversion.factor * a.field_in_sensor, 1e-12);
    EXPECT_NEAR(b.residual, conversion.factor * a.residual, 1e-12);
    for (const char* angle : {"pitch_deg", "roll_deg", "yaw_deg"}) {
      EXPECT_TRUE(std::isnan(a[angle]) ? std::isnan(b[angle])
                                       : std::abs(a[angle] - b[angle]) < 1e-9)
          << angle;
    }
  }
}

// Standard uncertainties of sensitivities are divided by the factor; those of biases do not change.
TEST(ConvertedRecord, HasItsCovariancesInTheNewUnit) {
  const Calibration record = record_in_si();
  const FieldConversion conversion = field_conversion(record.sensor.field, "m/s^2");
  const Calibration other = converted(record, conversion);
  const Eigen::MatrixXd C = parameter_covariance(record);
  const Eigen::MatrixXd D = parameter_covariance(other);
  ASSERT_GT(record.fit.uncertainty->sources.size(), 2U);
  for (Eigen::Index i = 0; i < 12; ++i) {
    for (Eigen::Index j = 0; j < 12; ++j) {
      const double unit_i = i % 4 == 0 ? 1.0 : 1.0 / conversion.factor;
      const double unit_j = j % 4 == 0 ? 1.0 : 1.0 / conversion.factor;
      EXPECT_NEAR(D(i, j), unit_i * unit_j * C(i, j), 1e-12 * std::sqrt(C(i, i) * C(j, j)));
    }
  }
  EXPECT_MATRIX_NEAR(other.fit.statistics->sensitivity_se,
                     record.fit.statistics->sensitivity_se / conversion.factor, 1e-15);
  EXPECT_MATRIX_NEAR(other.fit.statistics->bias_se, record.fit.statistics->bias_se, 0.0);
  EXPECT_NEAR(other.sensor.field.magnitude_u, conversion.factor * record.sensor.field.magnitude_u,
              1e-12);
  for (std::size_t i = 0; i < record.fit.residuals.size(); ++i) {
    EXPECT_NEAR(other.fit.residuals[i].magnitude,
                conversion.factor * record.fit.residuals[i].magnitude, 1e-12);
  }
}

TEST(ConvertedRecord, ComesBack) {
  const Calibration record = record_in_si();
  const Calibration there = converted(record, field_conversion(record.sensor.field, "m/s^2"));
  const Calibration back = converted(there, field_conversion(there.sensor.field, "g"));
  EXPECT_EQ(back.sensor.field.unit, "g");
  EXPECT_NEAR(back.sensor.field.magnitude, 1.0, 1e-15);
  ASSERT_TRUE(back.sensor.field.local_gravity);
  EXPECT_NEAR(*back.sensor.field.local_gravity, *record.sensor.field.local_gravity, 1e-12);
  EXPECT_MATRIX_NEAR(back.sensor.response.sensitivity, record.sensor.response.sensitivity, 1e-14);
  EXPECT_MATRIX_NEAR(parameter_covariance(back), parameter_covariance(record), 1e-20);
  EXPECT_MATRIX_NEAR(*back.sensor.field.in_table, *record.sensor.field.in_table, 1e-14);
  EXPECT_MATRIX_NEAR(*back.sensor.field.in_table_covariance,
                     *record.sensor.field.in_table_covariance, 1e-20);
}

// ---- the frame of the assembly ----

TEST(FrameOfTheAssembly, TurnsFieldsAndTheirCovariances) {
  Calibration record = record_in_si(4);
  record.fit.conditions = {};  // one block
  // The variances of the sensitivities along x are made larger.
  for (const Eigen::Index i : {1, 5, 9}) {
    record.fit.statistics->covariance(i, i) *= 25.0;
  }
  const Eigen::Matrix3d mount = rotation_by({0.4, -1.1, 0.7});
  record.sensor.rotation_sensor_from_assembly = mount;
  const Calibration turned = in_assembly_frame(record);
  EXPECT_FALSE(turned.sensor.rotation_sensor_from_assembly);
  const Reducer in_sensor(record);
  const Reducer in_assembly(turned);
  const ReadingPropagation of_sensor(record, in_sensor);
  const ReadingPropagation of_assembly(turned, in_assembly);
  RandomStream random(6);
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector3d f = random.normals<3>().normalized();
    const Eigen::VectorXd read = record.sensor.response.at(mount * f);
    const std::vector<double> v(read.begin(), read.end());
    EXPECT_MATRIX_NEAR(in_assembly.reduce(v).field_in_sensor, f, 1e-13);
    EXPECT_MATRIX_NEAR(in_sensor.reduce(v).field_in_sensor, mount * f, 1e-13);
    const Eigen::Matrix3d C = of_sensor.field_covariance(v);
    EXPECT_MATRIX_NEAR(of_assembly.field_covariance(v), mount.transpose() * C * mount,
                       1e-6 * C.norm());
    EXPECT_NEAR(of_assembly.at(v).residual / of_sensor.at(v).residual, 1.0, 1e-4);
  }
}

TEST(FrameOfTheAssembly, TakesMirroredMountsAndSecondFields) {
  Calibration record = record_in_si(5);
  const Eigen::Matrix3d mirror = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  record.sensor.rotation_sensor_from_assembly = mirror;
  record.sensor.also = {{.kind = "gravity", .sensitivity = 1e-3 * Eigen::Matrix3d::Identity()}};
  const Calibration turned = in_assembly_frame(record);
  EXPECT_EQ(turned.sensor.response.sensitivity.col(0), record.sensor.response.sensitivity.col(0));
  EXPECT_EQ(turned.sensor.response.sensitivity.col(2), -record.sensor.response.sensitivity.col(2));
  EXPECT_MATRIX_NEAR(turned.sensor.also[0].sensitivity, 1e-3 * mirror, 1e-18);
  EXPECT_EQ(turned.sensor.response.bias, record.sensor.response.bias);
  // A covariance of x with y changes its sign; variances do not change.
  const Eigen::MatrixXd& C = record.fit.statistics->covariance;
  const Eigen::MatrixXd& D = turned.fit.statistics->covariance;
  EXPECT_MATRIX_NEAR(D.diagonal(), C.diagonal(), 1e-22);
  EXPECT_NEAR(D(1, 2), -C(1, 2), 1e-22);
  EXPECT_NEAR(D(2, 3), C(2, 3), 1e-22);
}

TEST(FrameOfTheAssembly, IsTheSensorsWithoutAnAssembly) {
  const Calibration record = record_in_si(6);
  const Calibration same = in_assembly_frame(record);
  EXPECT_EQ(same.sensor.response.sensitivity, record.sensor.response.sensitivity);
  EXPECT_EQ(same.fit.statistics->covariance, record.fit.statistics->covariance);
  Calibration turned = record;
  turned.sensor.rotation_sensor_from_assembly = rotation_by({0.1, 0.2, 0.3});
  turned.fit.statistics.reset();
  const Calibration once = in_assembly_frame(turned);
  EXPECT_EQ(in_assembly_frame(once).sensor.response.sensitivity, once.sensor.response.sensitivity);
}

// ---- one axis ----

SensorModel sensor_of_axes(const SensitivityMatrix& S, const std::string& kind) {
  return test::truth_of({.bias = Eigen::VectorXd::LinSpaced(S.rows(), 0.1, 0.2), .sensitivity = S},
                        kind);
}

TEST(ReducedSingleAxis, IsTheComponentAlongIt) {
  SensitivityMatrix S(2, 3);
  S << 2.0, 0.2, -0.1, 0.3, -1.5, 0.4;
  for (const double factor : {1.0, 9.81}) {
    const SensorModel sensor = sensor_of_axes(S, "inclinometer");
    const Reducer reducer(sensor, {.magnitude = factor, .factor = factor});
    for (const Eigen::Vector3d& f :
         {Eigen::Vector3d(0.6, -0.8, 0.0), Eigen::Vector3d(-0.3, 0.4, std::sqrt(0.75))}) {
      const Eigen::VectorXd v = sensor.response.at(f);
      for (Eigen::Index k = 0; k < 2; ++k) {
        const double along = S.row(k).normalized().dot(f);
        const ReducedAxis reduced = reducer.reduce_axis(static_cast<std::size_t>(k), v(k));
        EXPECT_NEAR(reduced.component, factor * along, 1e-12);
        EXPECT_NEAR(reduced.angle_rad, std::asin(along), 1e-12);
        EXPECT_FALSE(reduced.clamped || reduced.extrapolated);
        EXPECT_NEAR(reducer.sensitivity_of(static_cast<std::size_t>(k)), S.row(k).norm() / factor,
                    1e-14);
      }
    }
  }
}

TEST(ReducedSingleAxis, IsClampedBeyondTheField) {
  SensitivityMatrix S(1, 3);
  S << 0.0, 3.0, 4.0;
  const Reducer reducer(sensor_of_axes(S, "inclinometer"));
  const double bias = sensor_of_axes(S, "inclinometer").response.bias(0);
  for (const double side : {1.0, -1.0}) {
    const ReducedAxis beyond = reducer.reduce_axis(0, bias + side * 5.5);
    EXPECT_TRUE(beyond.clamped);
    EXPECT_NEAR(beyond.component, side * 1.1, 1e-14);
    EXPECT_NEAR(beyond.angle_rad, side * std::numbers::pi / 2.0, 1e-14);
    EXPECT_FALSE(reducer.reduce_axis(0, bias + side * 4.9).clamped);
  }
}

TEST(ReducedSingleAxis, HasNoAngleForKindsWithoutOne) {
  SensitivityMatrix S(1, 3);
  S << 0.0, 0.0, 2.0;
  const SensorModel sensor = sensor_of_axes(S, "magnetometer");
  const ReducedAxis reduced = Reducer(sensor).reduce_axis(0, sensor.response.bias(0) + 1.0);
  EXPECT_DOUBLE_EQ(reduced.component, 0.5);
  EXPECT_EQ(reduced.angle_rad, 0.0);
  EXPECT_FALSE(reduced.clamped);
}

// Biases of method bias include the effect of the field, so an axis has a difference of components
// and no angle.
TEST(ReducedSingleAxis, HasNoAngleIfTheBiasHoldsTheField) {
  SensitivityMatrix S(1, 3);
  S << 0.0, 0.0, 2.0;
  Calibration record;
  record.sensor = sensor_of_axes(S, "accelerometer");
  record.fit.method = Method::bias;
  const ReducedAxis reduced = Reducer(record).reduce_axis(0, record.sensor.response.bias(0) + 0.5);
  EXPECT_DOUBLE_EQ(reduced.component, 0.25);
  EXPECT_TRUE(std::isnan(reduced.angle_rad));
}

TEST(ReducedSingleAxis, FollowsItsTemperature) {
  SensitivityMatrix S(2, 3);
  S << 2.0, 0.0, 0.0, 0.0, 4.0, 0.0;
  SensorModel sensor = sensor_of_axes(S, "inclinometer");
  sensor.temperature = TemperatureResponse{.spans = {{.reference = 20.0, .low = 0.0, .high = 40.0},
                                                     {.reference = 30.0, .low = 0.0, .high = 40.0}},
                                           .bias = Eigen::Vector2d(1e-2, -2e-2),
                                           .scale = Eigen::Vector2d(1e-3, 5e-3)};
  const Reducer reducer(sensor);
  EXPECT_TRUE(reducer.has_own_temperatures());
  const SensorTemperature t(std::vector<double>{10.0, 36.0});
  // v = b + b' d + (1 + s' d) S f with d = -10 and 6.
  const double first = sensor.response.bias(0) - 0.1 + (1.0 - 0.01) * 2.0 * 0.5;
  const double second = sensor.response.bias(1) - 0.12 + (1.0 + 0.03) * 4.0 * -0.25;
  EXPECT_NEAR(reducer.reduce_axis(0, first, t).component, 0.5, 1e-14);
  EXPECT_NEAR(reducer.reduce_axis(1, second, t).component, -0.25, 1e-14);
  EXPECT_FALSE(reducer.reduce_axis(0, first, t).extrapolated);
  EXPECT_TRUE(reducer.reduce_axis(0, first, SensorTemperature({10.0, 41.0})).extrapolated);
  // Without a temperature the reference temperature is used.
  EXPECT_NEAR(reducer.reduce_axis(0, sensor.response.bias(0) + 1.0).component, 0.5, 1e-14);
}

TEST(ReducedSingleAxis, TellsReadingsAtTheEndsOfItsRange) {
  SensorModel sensor = test::accelerometer_truth();
  EXPECT_FALSE(Reducer(sensor).is_saturated(1e9));
  sensor.instrument.range = ReadingRange{.low = -2.0, .high = 3.0};
  const Reducer reducer(sensor);
  for (const double reading : {-2.0, 3.0, -5.0, 3.5}) {
    EXPECT_TRUE(reducer.is_saturated(reading)) << reading;
  }
  EXPECT_FALSE(reducer.is_saturated(-1.99));
  EXPECT_FALSE(reducer.is_saturated(2.99));
}

// ---- two axes of a sun sensor ----

SensitivityMatrix two_photodiodes() {
  SensitivityMatrix S(2, 3);
  S << 2.0, 0.3, 0.9, -0.2, 1.8, 1.1;
  return S;
}

TEST(ClosedBySunsLength, SeesTheSideThatTheOrderOfAxesTells) {
  const SensorModel sensor = sensor_of_axes(two_photodiodes(), "optical");
  SensorModel exchanged = sensor;
  exchanged.response.sensitivity.row(0).swap(exchanged.response.sensitivity.row(1));
  exchanged.response.bias.reverseInPlace();
  const Eigen::Vector3d across = Eigen::Vector3d(sensor.response.sensitivity.row(0))
                                     .cross(Eigen::Vector3d(sensor.response.sensitivity.row(1)))
                                     .normalized();
  const Eigen::Vector3d f = (across + Eigen::Vector3d(0.2, -0.3, 0.1)).normalized();
  ASSERT_GT(f.dot(across), 0.0);
  const Eigen::VectorXd v = sensor.response.at(f);
  EXPECT_MATRIX_NEAR(Reducer(sensor).closed_field(v(0), v(1)).in_sensor, f, 1e-12);
  // Exchanged axes give the field's mirror image across the plane of the axes.
  const Eigen::Vector3d mirrored = f - 2.0 * f.dot(across) * across;
  EXPECT_MATRIX_NEAR(Reducer(exchanged).closed_field(v(1), v(0)).in_sensor, mirrored, 1e-12);
}

// The closed field has the length F and reproduces the readings.
TEST(ClosedBySunsLength, HasTheLengthOfTheFieldAndItsReadings) {
  const SensorModel sensor = sensor_of_axes(two_photodiodes(), "optical");
  RandomStream random(8);
  for (const double magnitude : {1.0, 1.03}) {
    const Reducer reducer(sensor, {.magnitude = magnitude});
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector2d v = sensor.response.bias + 0.3 * random.normals<2>();
      const Reducer::ClosedField closed = reducer.closed_field(v(0), v(1));
      EXPECT_MATRIX_NEAR(sensor.response.at(closed.in_sensor), v, 1e-12);
      EXPECT_NEAR(closed.in_sensor.norm(), magnitude, 1e-12);
      EXPECT_FALSE(closed.clamped);
    }
    // If the two components already exceed F, the third component is 0 and the result is clamped.
    const Reducer::ClosedField bright = reducer.closed_field(5.0, 5.0);
    EXPECT_TRUE(bright.clamped);
    EXPECT_GT(bright.in_sensor.norm(), magnitude);
    EXPECT_MATRIX_NEAR(sensor.response.at(bright.in_sensor), Eigen::Vector2d(5.0, 5.0), 1e-12);
  }
}

TEST(ClosedBySunsLength, FollowsTemperatureAndUnit) {
  SensorModel sensor = sensor_of_axes(two_photodiodes(), "optical");
  sensor.temperature = TemperatureResponse{.spans = {{.reference = 20.0}},
                                           .bias = Eigen::Vector2d(1e-3, 2e-3),
                                           .scale = Eigen::Vector2d(-2e-3, 1e-3)};
  const SensorTemperature hot = 70.0;
  const Reducer reducer(sensor, {.magnitude = 1361.0, .factor = 1361.0});
  const Eigen::Vector3d across = Eigen::Vector3d(sensor.response.sensitivity.row(0))
                                     .cross(Eigen::Vector3d(sensor.response.sensitivity.row(1)))
                                     .normalized();
  const Eigen::Vector3d f = (across + Eigen::Vector3d(-0.2, 0.1, 0.2)).normalized();
  const Eigen::VectorXd v = response_at(sensor, f, hot);
  EXPECT_MATRIX_NEAR(reducer.closed_field(v(0), v(1), hot).in_sensor, 1361.0 * f, 1e-9);
}

TEST(ClosedBySunsLength, NeedsTwoAxesThatAreNotParallelOfASunSensor) {
  EXPECT_FALSE(
      Reducer(sensor_of_axes(two_photodiodes(), "magnetometer")).completes_third_component());
  SensitivityMatrix parallel = two_photodiodes();
  parallel.row(1) = -2.0 * parallel.row(0);
  EXPECT_FALSE(Reducer(sensor_of_axes(parallel, "optical")).completes_third_component());
  const Reducer one(sensor_of_axes(two_photodiodes().topRows(1), "optical"));
  EXPECT_FALSE(one.completes_third_component());
  EXPECT_THAT(
      test::complaint_of<DomainError>([&] { static_cast<void>(one.closed_field(0.1, 0.2)); }),
      HasSubstr("needs two axes"));
  // If the biases include the effect of the light, the third component cannot be computed.
  Calibration record;
  record.sensor = sensor_of_axes(two_photodiodes(), "optical");
  EXPECT_TRUE(Reducer(record).completes_third_component());
  record.fit.method = Method::bias;
  EXPECT_FALSE(Reducer(record).completes_third_component());
}

// ---- three axes and more ----

TEST(ReducedFields, HaveWhatASecondFieldAddsTakenOut) {
  SensorModel sensor = test::accelerometer_truth();
  sensor.instrument.kind = "gyroscope";
  SensitivityMatrix by_gravity(3, 3);
  by_gravity << 1e-2, 2e-3, 0.0, -3e-3, 5e-3, 1e-3, 0.0, 0.0, 2e-2;
  sensor.also = {{.kind = "gravity", .unit = "g", .sensitivity = by_gravity}};
  const Eigen::Vector3d rate(0.2, -0.1, 0.4);
  const Eigen::Vector3d up(0.3, 0.4, std::sqrt(0.75));
  const Eigen::VectorXd v = sensor.response.at(rate) + by_gravity * up;
  for (const double factor : {1.0, 57.3}) {
    const Reducer reducer(sensor, {.factor = factor});
    EXPECT_MATRIX_NEAR(reducer.reduce({v.data(), 3}, {.up = up}).field_in_sensor, factor * rate,
                       1e-12);
    const Eigen::Vector3d left = reducer.reduce({v.data(), 3}).field_in_sensor / factor - rate;
    EXPECT_MATRIX_NEAR(Eigen::Matrix3d(sensor.response.sensitivity) * left, by_gravity * up, 1e-12);
  }
  sensor.also.push_back(sensor.also.front());
  EXPECT_THROW(Reducer{sensor}, DomainError);
}

TEST(ReducedFields, OfRowsFollowEachAxissTemperature) {
  SensorModel sensor = test::accelerometer_truth();
  sensor.temperature =
      TemperatureResponse{.spans = {{.reference = 20.0}, {.reference = 21.0}, {.reference = 22.0}},
                          .bias = Eigen::Vector3d(1e-3, -2e-3, 3e-3),
                          .scale = Eigen::Vector3d(2e-3, 1e-3, -1e-3)};
  const Reducer reducer(sensor);
  RandomStream random(9);
  constexpr Eigen::Index n = 15;
  Eigen::MatrixXd readings(n, 3);
  Eigen::MatrixXd temperatures(n, 3);
  Eigen::MatrixX3d fields(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d f = random.normals<3>();
    const Eigen::Vector3d t = Eigen::Vector3d::Constant(25.0) + 10.0 * random.normals<3>();
    fields.row(i) = f;
    temperatures.row(i) = t;
    readings.row(i) =
        response_at(sensor, f, SensorTemperature(std::vector<double>(t.begin(), t.end())));
  }
  EXPECT_MATRIX_NEAR(reducer.reduce_rows(readings, temperatures), fields, 1e-12);
  EXPECT_THROW(static_cast<void>(reducer.reduce_rows(readings, temperatures.leftCols(2))),
               DomainError);
}

// Six photodiodes, one on each face: three are lit, and the readings of the others are their
// biases.
TEST(ReducedFields, OfOneSidedAxesComeFromThoseThatSeeTheLight) {
  SensitivityMatrix S(6, 3);
  for (Eigen::Index k = 0; k < 6; ++k) {
    S.row(k) = (k % 2 == 0 ? 2.0 : -1.5) * Eigen::RowVector3d::Unit(k / 2);
  }
  SensorModel sensor = sensor_of_axes(S, "optical");
  sensor.instrument.one_sided = true;
  const Reducer reducer(sensor);
  RandomStream random(10);
  for (int i = 0; i < 20; ++i) {
    Eigen::Vector3d f = random.normals<3>();
    for (double& component : f) {
      component += std::copysign(0.3, component);
    }
    const Eigen::VectorXd above = (S * f).cwiseMax(0.0);
    const Eigen::VectorXd v = sensor.response.bias + above;
    const ReducedReading reduced = reducer.reduce({v.data(), 6});
    EXPECT_TRUE(reduced.determined);
    EXPECT_MATRIX_NEAR(reduced.field_in_sensor, f, 1e-12);
  }
  const Eigen::VectorXd dark = sensor.response.bias;
  EXPECT_FALSE(reducer.reduce({dark.data(), 6}).determined);
}

TEST(ReducedFields, NameTheirResults) {
  const SensorModel sensor = test::accelerometer_truth();
  const Eigen::VectorXd v = sensor.response.at({0.6, 0.0, 0.8});
  const ReducedReading reduced = Reducer(sensor)(std::array{v(0), v(1), v(2)});
  EXPECT_EQ(reduced["x"], reduced.field_in_sensor.x());
  EXPECT_EQ(reduced["z"], reduced.field_in_sensor.z());
  EXPECT_EQ(reduced["residual"], reduced.residual);
  EXPECT_NEAR(reduced["pitch_deg"], std::asin(0.6) * deg_per_rad, 1e-10);
  EXPECT_THAT(test::complaint_of<DomainError>([&] { static_cast<void>(reduced["heading_deg"]); }),
              testing::AllOf(HasSubstr("'heading_deg' is not a value"), HasSubstr("pitch_deg")));
}

}  // namespace
}  // namespace axiscal
