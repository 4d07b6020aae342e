// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>

#include <Eigen/LU>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/design_quality.hpp"
#include "axiscal/calib/forecast.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/calib/study.hpp"
#include "axiscal/calib/tolerance.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/instruments/inclination.hpp"
#include "matchers.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

const Eigen::Vector3d gravity(0.0, 0.0, 1.0);

TEST(AssessDesign, TheStandardDesignsAreTheBest) {
  for (const int points : {6, 12, 24}) {
    for (const Eigen::Vector3d& field : {gravity, Eigen::Vector3d(0.3, -0.5, 0.7)}) {
      const DesignQuality quality = assess_design(standard_design(points), Positioner(), field);
      if (points == 6 && field != gravity) {
        EXPECT_LT(quality.d_efficiency, 0.999);  // optimal only for a field along the normal
        continue;
      }
      EXPECT_TRUE(quality.determined);
      EXPECT_NEAR(quality.d_efficiency, 1.0, 1e-12) << points;
      EXPECT_NEAR(quality.a_efficiency, 1.0, 1e-12);
      EXPECT_NEAR(quality.g_efficiency, 1.0, 1e-12);
      EXPECT_NEAR(quality.largest_prediction_variance, 4.0 / points, 1e-12);
      EXPECT_MATRIX_NEAR(quality.variance_inflation, Eigen::Vector3d::Ones(), 1e-12);
    }
  }
}

TEST(AssessDesign, SaysThatTooFewFacesDetermineNothing) {
  std::vector<DesignEntry> design = standard_design(12);
  design.erase(design.begin() + 6, design.end());  // three rest faces remain
  const DesignQuality quality = assess_design(design, Positioner(), gravity);
  EXPECT_FALSE(quality.determined);
  EXPECT_EQ(quality.d_efficiency, 0.0);
  EXPECT_TRUE(std::isinf(quality.largest_prediction_variance));
}

TEST(AssessDesign, WorstDirectionIsTheMaximumOverTheSphere) {
  std::vector<DesignEntry> design = standard_design(12);
  design.erase(design.begin(), design.begin() + 3);
  const DesignQuality quality = assess_design(design, Positioner(), gravity);
  ASSERT_TRUE(quality.determined);
  Eigen::MatrixXd X(9, 4);
  for (int i = 0; i < 9; ++i) {
    X.row(i) << 1.0, (Positioner()
                          .rotation_table_from_positioner(design[static_cast<std::size_t>(i)].point)
                          .transpose() *
                      gravity)
                         .transpose();
  }
  const Eigen::Matrix4d C = (X.transpose() * X).inverse();
  RandomStream random(1);
  double largest = 0.0;
  for (int i = 0; i < 20000; ++i) {
    Eigen::Vector4d x;
    x << 1.0, random.normals<3>().normalized();
    largest = std::max(largest, x.dot(C * x));
  }
  EXPECT_GE(quality.largest_prediction_variance, largest);
  EXPECT_NEAR(quality.largest_prediction_variance, largest, 0.01 * largest);
  EXPECT_LT(quality.g_efficiency, 1.0);
}

TEST(OptimalDesign, FindsADesignAsGoodAsTheStandardOne) {
  const OptimalDesign twelve = optimal_design(12, gravity, 1);
  EXPECT_EQ(twelve.design.size(), 12U);
  EXPECT_NEAR(twelve.d_efficiency, 1.0, 1e-9);
  EXPECT_NEAR(twelve.d_efficiency_of_standard, 1.0, 1e-12);
  const OptimalDesign all = optimal_design(24, gravity, 1);
  EXPECT_NEAR(all.d_efficiency, 1.0, 1e-12);
  for (const int points : {10, 11, 13, 16}) {
    const OptimalDesign some = optimal_design(points, gravity, 1);
    EXPECT_EQ(some.design.size(), static_cast<std::size_t>(points));
    EXPECT_GT(some.d_efficiency, 0.8);
    EXPECT_LE(some.d_efficiency, 1.0 + 1e-12);
    EXPECT_EQ(some.parameters, 10);
    EXPECT_EQ(optimal_design(points, gravity, 1).design.front().point, some.design.front().point);
  }
  const OptimalDesign six = optimal_design(6, gravity, 1);
  EXPECT_EQ(six.parameters, 4);
  EXPECT_NEAR(six.d_efficiency, 1.0, 1e-9);  // each rest face once
  EXPECT_THROW(static_cast<void>(optimal_design(3, gravity, 1)), DomainError);
  EXPECT_THROW(static_cast<void>(optimal_design(25, gravity, 1)), DomainError);
}

struct ForecastCase {
  Method method;
  int points;
  int replicates;
  double normal_u_rad;
  double level_u_rad;
};

class ForecastAgrees : public testing::TestWithParam<ForecastCase> {};

// The forecast agrees with many calibrations with random errors of cubes, tables and readings.
TEST_P(ForecastAgrees, WithSimulationWithinFivePercent) {
  const auto& [method, points, replicates, normal_u, level_u] = GetParam();
  ForecastSetup setup{.nominal = test::accelerometer_truth(),
                      .design = standard_design(points),
                      .replicates = replicates,
                      .method = method,
                      .noise_sd = 2.5e-4,
                      .normal_u_rad = normal_u,
                      .level_u_rad = level_u};
  const Forecast result = forecast(setup);
  Experiment experiment = test::experiment_for(setup.nominal);
  experiment.fit.method = method;
  experiment.fit.search_for_mistakes = false;  // slow, and without effect on the coefficients
  RandomStream random(21);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(12);
  double pitch_squares = 0.0;
  double roll_squares = 0.0;
  const double pitch = 0.6;
  const double roll = -1.1;
  const Eigen::Vector3d attitude(std::sin(pitch), std::cos(pitch) * std::sin(roll),
                                 std::cos(pitch) * std::cos(roll));
  const LinearResponse& truth = setup.nominal.response;
  constexpr int trials = 3000;
  for (int trial = 0; trial < trials; ++trial) {
    FaceNormals normals = Positioner().normals();
    for (Eigen::Vector3d& n : normals) {
      const Eigen::Matrix<double, 3, 2> T = tangents_of(n);
      n = (n + normal_u * T * random.normals<2>()).normalized();
    }
    const Eigen::Vector2d slope = level_u * random.normals<2>();
    const LinearResponse found =
        calibrate(experiment, simulate(setup.nominal,
                                       make_run_sheet(setup.design, replicates,
                                                      static_cast<std::uint64_t>(trial) + 1),
                                       {.noise_sd = setup.noise_sd,
                                        .slope = slope,
                                        .positioner = Positioner(normals),
                                        .seed = static_cast<std::uint64_t>(trial) + 1}))
            .sensor.response;
    for (Eigen::Index k = 0; k < 3; ++k) {
      squares(4 * k) += std::pow(found.bias(k) - truth.bias(k), 2);
      squares.segment<3>(4 * k + 1) +=
          (found.sensitivity.row(k) - truth.sensitivity.row(k)).cwiseAbs2().transpose();
    }
    const Eigen::Matrix3d S = found.sensitivity;
    const Eigen::Vector3d f = S.inverse() * (truth.at(attitude) - found.bias);
    pitch_squares += std::pow(std::asin(f.x()) - pitch, 2);
    roll_squares += std::pow(std::atan2(f.y(), f.z()) - roll, 2);
  }
  const Eigen::VectorXd rms = (squares / trials).cwiseSqrt();
  const Eigen::VectorXd stated = result.covariance().diagonal().cwiseSqrt();
  // The standard deviation of each rms is 1.3 %; that of pooled values is smaller.
  const double bias_ratio =
      std::sqrt((rms(0) * rms(0) + rms(4) * rms(4) + rms(8) * rms(8)) /
                (stated(0) * stated(0) + stated(4) * stated(4) + stated(8) * stated(8)));
  EXPECT_NEAR(bias_ratio, 1.0, 0.05);
  EXPECT_NEAR(rms.norm() / stated.norm(), 1.0, 0.05);
  for (Eigen::Index i = 0; i < 12; ++i) {
    EXPECT_NEAR(rms(i) / stated(i), 1.0, 0.06) << i;
  }
  const AngleUncertainty angles = forecast_angles(result, result.covariance(), pitch, roll);
  EXPECT_NEAR(std::sqrt(pitch_squares / trials) / angles.pitch_rad, 1.0, 0.05);
  EXPECT_NEAR(std::sqrt(roll_squares / trials) / angles.roll_rad, 1.0, 0.05);
}

INSTANTIATE_TEST_SUITE_P(Designs,
                         ForecastAgrees,
                         testing::Values(ForecastCase{Method::paired, 12, 1, 0.0, 0.0},
                                         ForecastCase{Method::paired, 12, 3, 1e-4, 1e-3},
                                         ForecastCase{Method::joint, 12, 1, 1e-4, 1e-3},
                                         ForecastCase{Method::joint, 24, 1, 0.0, 1e-3},
                                         ForecastCase{Method::known, 6, 2, 0.0, 0.0},
                                         ForecastCase{Method::known, 12, 1, 1e-4, 2e-4}),
                         [](const testing::TestParamInfo<ForecastCase>& test_case) {
                           return std::string(method_name(test_case.param.method)) +
                                  std::to_string(test_case.param.points) + "x" +
                                  std::to_string(test_case.param.replicates) +
                                  (test_case.param.normal_u_rad > 0.0 ? "Cube" : "");
                         });

// If the normals have a stated uncertainty, calibrate() uses generalised least squares, and so does
// the forecast. Ordinary least squares would give values 2.5 times as large.
TEST(Forecast, IsOfGeneralisedLeastSquaresWhereNormalsAreUncertain) {
  PositionerDescription description = Positioner().description();
  NormalCovariance C = NormalCovariance::Zero();
  for (const Face face : all_faces) {
    const Eigen::Vector3d n = Positioner().normal(face);
    const Eigen::Index at = 3 * static_cast<Eigen::Index>(face);
    C.block<3, 3>(at, at) = 9e-8 * (Eigen::Matrix3d::Identity() - n * n.transpose());
  }
  description.normal_covariance = C;
  ForecastSetup setup{.nominal = test::accelerometer_truth(),
                      .design = standard_design(12),
                      .replicates = 2,
                      .method = Method::joint,
                      .noise_sd = 1e-4,
                      .positioner = Positioner(description)};
  const Eigen::VectorXd found = forecast(setup).covariance().diagonal().cwiseSqrt();
  StudySetup study;
  study.truth = setup.nominal;
  study.experiment = test::experiment_for(setup.nominal);
  study.experiment.fit.method = Method::joint;
  study.experiment.fit.drift = DriftSetup::none;
  study.experiment.fit.seats = SeatSetup::none;
  study.experiment.positioner = setup.positioner;
  study.design = setup.design;
  study.replicates = 2;
  study.noise_sd = Eigen::Vector3d::Constant(1e-4);
  study.random_normals = true;
  study.angles = false;
  const std::vector<StudyResult> results = results_of(run_study(study, 600, 8));
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_NEAR(found(static_cast<Eigen::Index>(i)) / results[i].sd, 1.0, 0.15)
        << results[i].parameter;
  }
  // By ordinary least squares the biases include the errors of the normals.
  description.normal_covariance.reset();
  setup.positioner = Positioner(description);
  setup.normal_u_rad = 3e-4;
  EXPECT_GT(std::sqrt(forecast(setup).covariance()(0, 0)), 1.5 * found(0));
}

TEST(Forecast, OfTheStandardDesignIsTheMethods) {
  // The prediction variance is sigma^2 / 3r, so the standard error of an angle is sigma / (s F
  // sqrt(3r)) (method.md, section 10).
  ForecastSetup setup{.nominal = test::truth_of({.bias = Eigen::Vector3d::Zero(),
                                                 .sensitivity = 2.0 * Eigen::Matrix3d::Identity()}),
                      .design = standard_design(12),
                      .replicates = 4,
                      .noise_sd = 1e-3,
                      .samples = 5};
  for (const Method method : {Method::paired, Method::joint, Method::known}) {
    setup.method = method;
    const Forecast result = forecast(setup);
    EXPECT_NEAR(result.noise(0, 0), 1e-6 / (12.0 * 4.0 * 5.0), 1e-18);
    EXPECT_NEAR(result.noise(1, 1), 1e-6 / (4.0 * 4.0 * 5.0), 1e-18);
    const double angle = 1e-3 / (2.0 * std::sqrt(3.0 * 4.0 * 5.0));
    EXPECT_NEAR(largest_angle_uncertainty(result, result.covariance()), angle, 1e-6 * angle);
    EXPECT_NEAR(forecast_angles(result, result.noise, 1.2, 0.3, PitchFormula::arctangent).pitch_rad,
                angle, 1e-9 * angle);
    EXPECT_NEAR(forecast_angles(result, result.noise, 1.2, 0.3).pitch_rad, angle / std::cos(1.2),
                1e-9);
  }
  setup.method = Method::paired;
  EXPECT_MATRIX_NEAR(forecast(setup).degrees_of_freedom, Eigen::Vector3d::Constant(20.0), 1e-12);
  setup.method = Method::joint;
  EXPECT_MATRIX_NEAR(forecast(setup).degrees_of_freedom,
                     Eigen::Vector3d::Constant(44.0 - 2.0 / 3.0), 1e-12);
}

TEST(Forecast, CountsTheMountAndItsRepeatability) {
  ForecastSetup setup{.nominal = test::truth_of({.bias = Eigen::Vector3d::Zero(),
                                                 .sensitivity = 2.0 * Eigen::Matrix3d::Identity()}),
                      .design = standard_design(12)};
  setup.mount = h_shaped_mounts("L", "R")[1];
  setup.mount.repeatability_rad = 5e-5;
  for (const Method method : {Method::paired, Method::joint, Method::known}) {
    setup.method = method;
    const Forecast result = forecast(setup);
    // A small rotation of the mount changes only the cross-axis terms, and rotates the field by the
    // same angle.
    EXPECT_NEAR(result.covariance()(0, 0), 0.0, 1e-20);
    EXPECT_NEAR(result.covariance()(1, 1), 0.0, 1e-16);
    EXPECT_NEAR(std::sqrt(result.covariance()(2, 2)), 2.0 * 5e-5, 1e-9);
    EXPECT_NEAR(largest_angle_uncertainty(result, result.covariance()), 5e-5, 1e-8);
  }
}

TEST(ReplicatesForAngle, FindsTheSmallestNumberThatIsEnough) {
  ForecastSetup setup{.nominal = test::truth_of({.bias = Eigen::Vector3d::Zero(),
                                                 .sensitivity = Eigen::Matrix3d::Identity()}),
                      .design = standard_design(12),
                      .noise_sd = 3e-4};
  const double wanted = 0.005 * rad_per_deg;
  // sigma / sqrt(3r) = 8.73e-5 gives r = 3.94.
  EXPECT_EQ(replicates_for_angle(setup, wanted), 4);
  setup.samples = 4;
  EXPECT_EQ(replicates_for_angle(setup, wanted), 1);
  setup.normal_u_rad = 2e-4;
  EXPECT_FALSE(replicates_for_angle(setup, wanted));
  EXPECT_THROW(static_cast<void>(replicates_for_angle(setup, 0.0)), DomainError);
}

TEST(Forecast, RefusesWhatCannotBe) {
  ForecastSetup setup{.nominal = test::accelerometer_truth(), .design = standard_design(6)};
  EXPECT_THROW(static_cast<void>(forecast(setup)), RefusedError);
  setup.method = Method::joint;
  EXPECT_THROW(static_cast<void>(forecast(setup)), RankDeficientError);
  setup.method = Method::known;
  EXPECT_NO_THROW(static_cast<void>(forecast(setup)));
  setup.noise_sd = -1.0;
  EXPECT_THROW(static_cast<void>(forecast(setup)), DomainError);
}

TEST(NormalCovarianceOf, IsThatOfCubesMadeToTheDrawing) {
  const CubeFeet drawing = feet_of_frame({});
  const Tolerances tolerances{.foot_height_m = 5e-6, .ball_radius_m = 2e-6, .squareness_rad = 1e-4};
  const NormalCovariance stated = normal_covariance_of(drawing, tolerances);
  NormalCovariance found = NormalCovariance::Zero();
  RandomStream random(2);
  constexpr int cubes = 4000;
  for (int i = 0; i < cubes; ++i) {
    const Positioner cube = random_positioner(drawing, {}, tolerances, random);
    Eigen::Matrix<double, 18, 1> error;
    for (const Face face : all_faces) {
      error.segment<3>(3 * static_cast<Eigen::Index>(face)) =
          cube.normal(face) - nominal_normal(face);
    }
    found += error * error.transpose() / cubes;
  }
  EXPECT_MATRIX_NEAR(found, stated, 0.08 * stated.maxCoeff());
  EXPECT_NEAR(found.trace() / stated.trace(), 1.0, 0.02);
}

TEST(StudyTolerances, ClosedFormAgreesWithSimulation) {
  const ToleranceStudy study{.nominal = test::accelerometer_truth(),
                             .design = standard_design(12),
                             .drawing = feet_of_frame({}),
                             .surface = {},
                             .tolerances = {.foot_height_m = 5e-6, .ball_radius_m = 1e-6},
                             .trials = 1500};
  const std::vector<ToleranceEffect> effects = study_tolerances(study);
  ASSERT_EQ(effects.size(), 3U);
  for (const ToleranceEffect& effect : effects) {
    std::printf(
        "%-7s bias %.1f/%.1f, sensitivity %.2f/%.2f, cross-axis %.1f/%.1f, angle %.1f/%.1f, "
        "worst %.1f (1e-6)\n",
        std::string(method_name(effect.method)).c_str(), 1e6 * effect.closed_form.bias,
        1e6 * effect.simulated.bias, 1e6 * effect.closed_form.sensitivity,
        1e6 * effect.simulated.sensitivity, 1e6 * effect.closed_form.cross_axis,
        1e6 * effect.simulated.cross_axis, 1e6 * effect.closed_form.angle_rad,
        1e6 * effect.simulated.angle_rad, 1e6 * effect.worst_angle_95_rad);
    EXPECT_NEAR(effect.simulated.bias / effect.closed_form.bias, 1.0, 0.05);
    EXPECT_NEAR(effect.simulated.cross_axis / effect.closed_form.cross_axis, 1.0, 0.05);
    EXPECT_NEAR(effect.simulated.angle_rad / effect.closed_form.angle_rad, 1.0, 0.05);
    EXPECT_GT(effect.worst_angle_95_rad, effect.simulated.angle_rad);
  }
}

TEST(StudyTolerances, AnAngleIsAnAngle) {
  // The normals have independent errors of 1e-4 rad in both directions. The mean square error of
  // the field's direction over the sphere, for each of two components, is 23/45 of their variance
  // by an independent calculation. The simulation agrees.
  ToleranceStudy study{.nominal = test::accelerometer_truth(),
                       .design = standard_design(12),
                       .drawing = feet_of_frame({}),
                       .surface = {},
                       .tolerances = {.squareness_rad = 1e-4},
                       .trials = 1500};
  const ToleranceEffect effect = study_tolerances(study).front();
  EXPECT_NEAR(effect.closed_form.angle_rad, 1e-4 * std::sqrt(23.0 / 45.0), 3e-6);
  EXPECT_NEAR(effect.simulated.angle_rad, 1e-4 * std::sqrt(23.0 / 45.0), 3e-6);
  // For a single cube the rms per component is at most the worst angle divided by sqrt(2).
  for (study.seed = 1; study.seed <= 20; ++study.seed) {
    study.trials = 1;
    const ToleranceEffect one = study_tolerances(study).front();
    EXPECT_GE(one.worst_angle_95_rad, 1.39 * one.simulated.angle_rad);
  }
  // An error of the scale does not change angles: method `known` on a sloping table.
  study.tolerances = {.fence_rad = 1e-6};
  study.slope = {0.02, 0.0};
  const ToleranceEffect known = study_tolerances(study).back();
  EXPECT_EQ(known.method, Method::known);
  EXPECT_NEAR(known.simulated.sensitivity, 2e-4, 1e-6);
  EXPECT_LT(known.simulated.angle_rad, 1e-6);
}

TEST(StudyTolerances, TakesTheCubeAsDrawn) {
  ToleranceStudy study{.nominal = test::accelerometer_truth(),
                       .design = standard_design(12),
                       .drawing = feet_of_frame({}),
                       .surface = {},
                       .tolerances = {.foot_height_m = 5e-6},
                       .trials = 600};
  study.drawing[static_cast<std::size_t>(Face::plus_z)][0].centre_m.z() += 1e-4;
  const ToleranceEffect effect = study_tolerances(study).front();
  EXPECT_NEAR(effect.simulated.angle_rad / effect.closed_form.angle_rad, 1.0, 0.06);
  study.tolerances = {.foot_height_m = 5e-3};
  EXPECT_GT(study_tolerances(study).front().unusable, 0);
}

TEST(StudyTolerances, ASlopeHurtsOnlyTheMethodThatTakesTheTableAsLevel) {
  ToleranceStudy study{.nominal = test::accelerometer_truth(),
                       .design = standard_design(12),
                       .drawing = feet_of_frame({}),
                       .surface = {},
                       .tolerances = {.foot_height_m = 5e-6, .fence_rad = 1e-3},
                       .slope = {0.005, -0.003},
                       .trials = 200};
  const std::vector<ToleranceEffect> effects = study_tolerances(study);
  EXPECT_NEAR(effects[0].simulated.angle_rad / effects[0].closed_form.angle_rad, 1.0, 0.15);
  EXPECT_NEAR(effects[1].simulated.angle_rad / effects[1].closed_form.angle_rad, 1.0, 0.15);
  study.design = standard_design(6);
  const std::vector<ToleranceEffect> six = study_tolerances(study);
  ASSERT_EQ(six.size(), 1U);
  EXPECT_EQ(six[0].method, Method::known);
  EXPECT_GT(six[0].simulated.angle_rad, 10.0 * six[0].closed_form.angle_rad);
  study.trials = 0;
  EXPECT_THROW(static_cast<void>(study_tolerances(study)), DomainError);
}

}  // namespace
}  // namespace axiscal
