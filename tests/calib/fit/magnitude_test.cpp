// SPDX-License-Identifier: Apache-2.0
// Method magnitude for unknown orientations, coverage of the sphere, alignment of two instruments.
#include <cmath>

#include <Eigen/LU>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/companion.hpp"
#include "axiscal/calib/orientation_quality.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/light_field.hpp"
#include "axiscal/field/sun.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::Contains;
using testing::HasSubstr;

Eigen::Matrix3d soft_iron(MagnitudeShape shape) {
  if (shape == MagnitudeShape::triangular) {
    return (Eigen::Matrix3d() << 1.2, 0.05, -0.08, 0.0, 0.9, 0.04, 0.0, 0.0, 1.05).finished();
  }
  return (Eigen::Matrix3d() << 1.2, 0.05, -0.08, 0.05, 0.9, 0.04, -0.08, 0.04, 1.05).finished();
}

Experiment magnitude_experiment(MagnitudeShape shape = MagnitudeShape::symmetric) {
  Experiment experiment;
  experiment.instrument.kind = "magnetometer";
  experiment.field.of = make_field("geomagnetic");
  experiment.field.magnitude = 50.0;
  experiment.field.unit = "uT";
  experiment.fit.shape = shape;
  return experiment;
}

const Eigen::Vector3d hard_iron(30.0, -70.0, 15.0);

Observations hand_motion(const std::vector<Eigen::Vector3d>& directions,
                         const Eigen::Matrix3d& S,
                         double noise,
                         std::uint64_t seed) {
  RandomStream random(seed, 3);
  Observations observations;
  observations.response.resize(static_cast<Eigen::Index>(directions.size()), 3);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Eigen::Vector3d e = random.normals<3>();
    observations.response.row(static_cast<Eigen::Index>(i)) =
        hard_iron + S * (50.0 * directions[i]) + noise * e;
    observations.readings.push_back({.run = static_cast<int>(i) + 1});
  }
  return observations;
}

class MagnitudeMethodOf : public testing::TestWithParam<MagnitudeShape> {};

TEST_P(MagnitudeMethodOf, CoversAsStated) {
  const Eigen::Matrix3d S = soft_iron(GetParam());
  const std::vector<Eigen::Vector3d> directions = directions_on_sphere(60);
  int covered = 0;
  int all = 0;
  for (std::uint64_t seed = 1; seed <= 150; ++seed) {
    const Calibration result =
        calibrate(magnitude_experiment(GetParam()), hand_motion(directions, S, 0.05, seed));
    const FitStatistics& s = *result.fit.statistics;
    ASSERT_EQ(s.degrees_of_freedom(0), 51.0);
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double t = s.coverage_factor(k);
      covered +=
          std::abs(result.sensor.response.bias(k) - hard_iron(k)) <= t * s.bias_se(k) ? 1 : 0;
      ++all;
      for (Eigen::Index j = 0; j < 3; ++j) {
        const double error = std::abs(result.sensor.response.sensitivity(k, j) - S(k, j));
        if (GetParam() == MagnitudeShape::triangular && j < k) {
          EXPECT_LT(error, 1e-12);  // S is upper triangular by definition
          continue;
        }
        covered += error <= t * s.sensitivity_se(k, j) ? 1 : 0;
        ++all;
      }
    }
  }
  EXPECT_NEAR(static_cast<double>(covered) / all, 0.95, 0.015);
}

INSTANTIATE_TEST_SUITE_P(Shapes,
                         MagnitudeMethodOf,
                         testing::Values(MagnitudeShape::symmetric, MagnitudeShape::triangular),
                         [](const auto& shape) { return std::string(shape_name(shape.param)); });

TEST(MagnitudeMethod, WithoutNoiseIsExact) {
  const Eigen::Matrix3d S = soft_iron(MagnitudeShape::symmetric);
  const Calibration result =
      calibrate(magnitude_experiment(), hand_motion(directions_on_sphere(20), S, 0.0, 1));
  EXPECT_EQ(result.fit.method, Method::magnitude);
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, S, 1e-12);
  EXPECT_MATRIX_NEAR(result.sensor.response.bias, hard_iron, 1e-10);
  EXPECT_FALSE(result.sensor.field.in_table.has_value());
}

TEST(MagnitudeMethod, IsCorrectedForItsBiasWhereHalfTheSphereIsMissing) {
  std::vector<Eigen::Vector3d> half;
  for (const Eigen::Vector3d& direction : directions_on_sphere(300)) {
    if (direction.z() > 0.0) {
      half.push_back(direction);
    }
  }
  const Eigen::Matrix3d S = soft_iron(MagnitudeShape::symmetric);
  double sum = 0.0;
  double se = 0.0;
  constexpr int runs = 60;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const Calibration result = calibrate(magnitude_experiment(), hand_motion(half, S, 0.5, seed));
    sum +=
        (result.sensor.response.bias(2) - hard_iron(2)) / result.fit.statistics->bias_se(2) / runs;
    se = result.fit.statistics->bias_se(2);
    if (seed == 1) {
      EXPECT_THAT(result.findings.notes,
                  test::HasNote(HasSubstr("were corrected for the error that noise causes")));
      ASSERT_FALSE(result.findings.warnings.empty());
      EXPECT_EQ(result.findings.warnings.front().code, WarningCode::coverage);
      EXPECT_THAT(result.findings.warnings.front().message, HasSubstr("-z"));
    }
  }
  EXPECT_GT(se, 0.0);
  // Without the correction the mean error is 8 sigma sqrt(N) / F = 1 standard error (method.md,
  // section 4).
  EXPECT_LT(std::abs(sum), 0.4);
}

TEST(MagnitudeMethod, TurnsTheFrameByLabelsWhereThereAreSome) {
  SensorModel truth = test::truth_of(
      {.bias = hard_iron,
       .sensitivity = (Eigen::Matrix3d() << 1.0, 0.06, -0.03, -0.02, 0.95, 0.05, 0.04, -0.01, 1.02)
                          .finished()},
      "magnetometer");
  truth.field.kind = "geomagnetic";
  truth.field.magnitude = 50.0;
  truth.field.in_table = 50.0 * Eigen::Vector3d(0.3, 0.5, -0.8).normalized();
  Experiment experiment = magnitude_experiment();
  experiment.fit.method = Method::magnitude;
  const Observations observations =
      simulate(truth, make_run_sheet(standard_design(24), 1, 1), {.noise_sd = 0.01, .seed = 1});
  const Calibration result = calibrate(experiment, observations);
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 2e-3);
  ASSERT_TRUE(result.sensor.field.in_table.has_value());
  EXPECT_MATRIX_NEAR(*result.sensor.field.in_table, *truth.field.in_table, 0.1);
}

TEST(MagnitudeMethod, RefusesOrientationsThatDoNotTell) {
  const Eigen::Matrix3d S = soft_iron(MagnitudeShape::symmetric);
  std::vector<Eigen::Vector3d> cap;
  std::vector<Eigen::Vector3d> plane;
  for (const Eigen::Vector3d& direction : directions_on_sphere(2000)) {
    if (direction.z() < -0.9) {
      cap.push_back(direction);
    }
    if (std::abs(direction.z()) < 0.02) {
      plane.push_back(direction);
    }
  }
  const auto complaint = [](const Observations& observations) {
    return test::complaint_of<RefusedError>(
        [&] { static_cast<void>(calibrate(magnitude_experiment(), observations)); });
  };
  EXPECT_THAT(complaint(hand_motion(cap, S, 0.1, 1)),
              testing::HasSubstr("cover too little of the sphere"));
  // The error names the cause that the readings show, here an axis that does not respond.
  Observations dead = hand_motion(directions_on_sphere(100), S, 0.1, 1);
  dead.response.col(1) *= 1e-3;
  EXPECT_THAT(complaint(dead), testing::HasSubstr("the readings of axis y hardly change"));
  EXPECT_THROW(static_cast<void>(calibrate(magnitude_experiment(), hand_motion(plane, S, 0.1, 1))),
               RefusedError);
  Observations levels = hand_motion(directions_on_sphere(30), S, 0.0, 1);
  levels.readings[4].level = 0.0;
  EXPECT_THROW(static_cast<void>(calibrate(magnitude_experiment(), levels)), RefusedError);
}

TEST(MagnitudeMethod, RefusesTooFewReadingsAndOtherThanThreeAxes) {
  const Eigen::Matrix3d S = soft_iron(MagnitudeShape::symmetric);
  EXPECT_THROW(static_cast<void>(calibrate(magnitude_experiment(),
                                           hand_motion(directions_on_sphere(9), S, 0.0, 1))),
               RefusedError);
  Experiment two = magnitude_experiment();
  two.instrument.axes = {"x", "y"};
  Observations observations = hand_motion(directions_on_sphere(30), S, 0.0, 1);
  observations.response.conservativeResize(Eigen::NoChange, 2);
  EXPECT_THROW(static_cast<void>(calibrate(two, observations)), RefusedError);
}

TEST(MagnitudeMethod, RobustRegressionPassesOverReadingsThatWereMoved) {
  const Eigen::Matrix3d S = soft_iron(MagnitudeShape::symmetric);
  Observations observations = hand_motion(directions_on_sphere(80), S, 0.05, 4);
  for (const Eigen::Index i : {7, 20, 33, 61}) {
    observations.response.row(i) *= 1.3;
  }
  Experiment experiment = magnitude_experiment();
  experiment.fit.robust = true;
  const Calibration result = calibrate(experiment, observations);
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, S, 5e-3);
  EXPECT_THAT(result.findings.notes,
              test::HasNote(HasSubstr(
                  "runs 8, 21, 34 and 62: robust regression ignores the readings of axis x")));
}

// ---- coverage of the sphere ----

// From 200 readings on, the uncertainties come from leaving out tenths of the readings. In a robust
// fit a reading changes the result more than by its weight alone.
TEST(MagnitudeMethod, RobustRegressionOfALongRecordingStatesItsUncertainty) {
  const Eigen::Matrix3d S = soft_iron(MagnitudeShape::symmetric);
  std::vector<Eigen::Vector3d> directions;
  RandomStream random(4);
  for (int i = 0; i < 250; ++i) {
    directions.push_back(random.normals<3>().normalized());
  }
  Experiment experiment = magnitude_experiment();
  experiment.fit.robust = true;
  double squares = 0.0;    // of the errors of the biases
  double variances = 0.0;  // as stated
  constexpr int runs = 60;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const Calibration result = calibrate(experiment, hand_motion(directions, S, 0.05, seed));
    squares += (result.sensor.response.bias - hard_iron).squaredNorm();
    variances += result.fit.statistics->bias_se.squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(variances / squares), 1.0, 0.1);
}

TEST(OrientationQuality, NamesTheGap) {
  std::vector<Eigen::Vector3d> directions;
  for (const Eigen::Vector3d& direction : directions_on_sphere(400)) {
    if (direction.dot(Eigen::Vector3d(1.0, 0.0, -1.0).normalized()) < 0.5) {
      directions.push_back(direction);
    }
  }
  Eigen::MatrixXd fields(static_cast<Eigen::Index>(directions.size()), 3);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    fields.row(static_cast<Eigen::Index>(i)) = 2.0 * directions[i];
  }
  const OrientationQuality quality = orientation_quality(fields, 2.0);
  EXPECT_EQ(direction_in_words(quality.gap), "+x -z");
  EXPECT_NEAR(quality.largest_gap_rad * deg_per_rad, 60.0, 4.0);
  EXPECT_NEAR(quality.fit_error, 0.0, 1e-14);
  // Readings are missing in a cap of 60 degrees. Directions up to 30 degrees from its rim count as
  // covered.
  EXPECT_NEAR(quality.coverage, 1.0 - 0.5 * (1.0 - std::cos(30.0 * rad_per_deg)), 0.02);
}

// ---- two instruments ----

struct CompanionPair {
  Eigen::MatrixXd fields;
  Eigen::MatrixXd companion;
};

// Two fields with an angle of 90 degrees plus the dip, in random attitudes. The axes of the
// companion are turned by R.
CompanionPair recorded_together(const Eigen::Matrix3d& R, double dip_deg, int count, double noise) {
  RandomStream random(8, 0);
  CompanionPair pair{.fields = Eigen::MatrixXd(count, 3), .companion = Eigen::MatrixXd(count, 3)};
  const double dip_rad = dip_deg * rad_per_deg;
  for (int i = 0; i < count; ++i) {
    const auto draw = [&] { return random.normals<3>(); };
    const Eigen::Matrix3d attitude = rotation_by(2.0 * draw());
    const Eigen::Vector3d up = attitude * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d m =
        attitude * Eigen::Vector3d(0.0, std::cos(dip_rad), -std::sin(dip_rad));
    pair.companion.row(i) = up + noise * draw();
    pair.fields.row(i) = R.transpose() * m + noise * draw();
  }
  return pair;
}

TEST(Align, FindsAnyRotationByTheConstantAngle) {
  for (const Eigen::Vector3d& turn :
       {Eigen::Vector3d(0.02, -0.01, 0.03), Eigen::Vector3d(0.0, 0.0, 1.6),
        Eigen::Vector3d(2.0, 2.0, -0.5)}) {
    const Eigen::Matrix3d R = rotation_by(turn);
    const CompanionPair pair = recorded_together(R, 50.0, 40, 1e-3);
    const Alignment alignment = align_by_constant_angle(pair.fields, pair.companion);
    EXPECT_NEAR(alignment.angle_rad * deg_per_rad, 140.0, 0.1);
    const Eigen::Matrix3d error = alignment.rotation_companion_from_sensor * R.transpose();
    const Eigen::Vector3d off(error(2, 1), error(0, 2), error(1, 0));
    for (Eigen::Index i = 0; i < 3; ++i) {
      EXPECT_LT(std::abs(off(i)), 5.0 * alignment.standard_error_rad(i));
    }
    EXPECT_LT(alignment.standard_error_rad.maxCoeff(), 2e-3);
  }
}

TEST(Align, IsAsGoodAtAnyDip) {
  // Near a dip of 90 degrees the angle between the fields changes little with the rotation, and
  // equally little with the noise.
  const auto aligned = [](double dip_deg) {
    const CompanionPair pair = recorded_together(Eigen::Matrix3d::Identity(), dip_deg, 60, 1e-3);
    return align_by_constant_angle(pair.fields, pair.companion);
  };
  const double at_equator = aligned(0.0).standard_error_rad.norm();
  for (const double dip_deg : {60.0, 80.0, 88.0}) {
    const Alignment alignment = aligned(dip_deg);
    EXPECT_NEAR(alignment.standard_error_rad.norm() / at_equator, 1.0, 0.3) << dip_deg;
    const Eigen::Matrix3d off =
        alignment.rotation_companion_from_sensor - Eigen::Matrix3d::Identity();
    EXPECT_LT(off.norm(), 8.0 * alignment.standard_error_rad.norm()) << dip_deg;
  }
}

// ---- the sun ----

TEST(Sun, IsTakenAtEachReadingsTime) {
  const Site site{.latitude_deg = 48.0, .longitude_deg = 11.0};
  const double start_s = 1782028800.0;  // 2026-06-21 08:00 UTC
  SensorModel truth = test::truth_of(
      {.bias = Eigen::Vector3d(0.1, 0.2, 0.3), .sensitivity = 2.0 * Eigen::Matrix3d::Identity()},
      "optical");
  Observations observations;
  observations.response.resize(12, 3);
  const Eigen::Matrix3d table = rotation_table_from_enu(40.0 * rad_per_deg);
  Eigen::Index row = 0;
  for (const DesignEntry& entry : standard_design(12)) {
    const double time_s = start_s + 600.0 * static_cast<double>(row);  // 2 h, 30 degrees in all
    const Eigen::Vector3d sun = table * sun_position(site, time_s).direction_in_enu;
    const Eigen::Matrix3d R = Positioner().rotation_table_from_positioner(entry.point).transpose();
    observations.response.row(row) = truth.response.at(R * sun);
    observations.readings.push_back(
        {.run = static_cast<int>(row) + 1, .point = entry.point, .time_s = time_s});
    ++row;
  }
  Experiment experiment;
  experiment.instrument = truth.instrument;
  experiment.field.of = make_field("light");
  experiment.field.of = std::make_shared<const LightField>(LightField::sun());
  experiment.table.site = site;
  experiment.table.fence_azimuth_rad = 40.0 * rad_per_deg;
  for (const Method method : {Method::known, Method::joint}) {
    experiment.fit.method = method;
    const Calibration result = calibrate(experiment, observations);
    EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.response.sensitivity, 1e-8);
  }
  // The sun's direction in the table depends on the azimuth of the fence.
  Experiment without = experiment;
  without.table.fence_azimuth_rad.reset();
  EXPECT_THROW(static_cast<void>(calibrate(without, observations)), SetupError);
  // Times from the start of the recording do not give the time of day.
  for (Reading& reading : observations.readings) {
    reading.time_s = *reading.time_s - start_s;
  }
  EXPECT_THROW(static_cast<void>(calibrate(experiment, observations)), RefusedError);
}

// A triangular S has its own frame. The stated covariance would not include the rotation of this
// frame.
TEST(AlignWithCompanion, WantsASymmetricShape) {
  RandomStream random(3);
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < 40; ++i) {
    directions.push_back(random.normals<3>().normalized());
  }
  const Observations observations =
      hand_motion(directions, soft_iron(MagnitudeShape::triangular), 0.05, 1);
  Calibration calibration =
      calibrate(magnitude_experiment(MagnitudeShape::triangular), observations);
  EXPECT_THAT(test::complaint_of<SetupError>([&] {
                align_with_companion(calibration, observations, calibration, observations,
                                     "r.json");
              }),
              HasSubstr("the shape 'symmetric'"));
}

}  // namespace
}  // namespace axiscal
